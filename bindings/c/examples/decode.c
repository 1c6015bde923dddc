// Gaussians per frame of a stream that arrives in pieces, kept at stable slots: decode [IN.gss]
#include "splatstream.h"
#include <stdio.h>
#include <stdlib.h>

// What a renderer would copy to its buffers.
static size_t changed(const SplatstreamUpdate *update) {
    size_t slots = 0;
    for (size_t i = 0; i < update->dirty_count; i++)
        slots += update->dirty[i].end - update->dirty[i].begin;
    return slots;
}

// Prints the frames that are complete. SPLATSTREAM_STATUS_NEED_BYTES or SPLATSTREAM_STATUS_END if all is well.
static SplatstreamStatus show(SplatstreamDecoder *decoder, SplatstreamSlots *slots) {
    SplatstreamFrame frame;
    SplatstreamStatus status;
    while ((status = splatstream_decoder_next_frame(decoder, &frame)) == SPLATSTREAM_STATUS_OK) {
        for (size_t i = 0; i < frame.warnings; i++)
            fprintf(stderr, "warning: %s\n", splatstream_decoder_warning(decoder, i));
        SplatstreamUpdate update;
        status = splatstream_slots_update(slots, decoder, &update);
        if (status != SPLATSTREAM_STATUS_OK) {
            fprintf(stderr, "%s\n", splatstream_slots_message(slots));
            return status;
        }
        printf("frame %u: %zu Gaussians, %zu slots to upload\n", (unsigned)frame.index, frame.gaussians,
               changed(&update));
    }
    if (status != SPLATSTREAM_STATUS_NEED_BYTES && status != SPLATSTREAM_STATUS_END)
        fprintf(stderr, "%s\n", splatstream_decoder_message(decoder));
    return status;
}

static SplatstreamStatus decode(FILE *file, SplatstreamDecoder *decoder, SplatstreamSlots *slots) {
    uint8_t piece[1000];
    SplatstreamStatus status = SPLATSTREAM_STATUS_NEED_BYTES;
    while (status == SPLATSTREAM_STATUS_NEED_BYTES) {
        size_t length = fread(piece, 1, sizeof piece, file);
        status = length > 0 ? splatstream_decoder_push(decoder, piece, length) : splatstream_decoder_end(decoder);
        if (status != SPLATSTREAM_STATUS_OK) {
            fprintf(stderr, "%s\n", splatstream_decoder_message(decoder));
            return status;
        }
        status = show(decoder, slots);
    }
    return status;
}

int main(int count, char **arguments) {
    if (splatstream_abi_version() != SPLATSTREAM_ABI_VERSION) {
        fprintf(stderr, "the library has another interface than the header\n");
        return EXIT_FAILURE;
    }
    const char *path = count > 1 ? arguments[1] : "examples/talk.gss";
    FILE *file = fopen(path, "rb");
    if (file == NULL) {
        perror(path);
        return EXIT_FAILURE;
    }
    SplatstreamDecoder *decoder = splatstream_decoder_new();
    SplatstreamSlots *slots = splatstream_slots_new(1 << 16);
    SplatstreamStatus status = decode(file, decoder, slots);
    splatstream_slots_free(slots);
    splatstream_decoder_free(decoder);
    fclose(file);
    return status == SPLATSTREAM_STATUS_END ? EXIT_SUCCESS : EXIT_FAILURE;
}
