// Every function of the interface, used well and badly: interface IN.gss, whose frames fit into 65536 slots.
#include "splatstream.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define CHECK(condition)                                                                                               \
    do {                                                                                                               \
        if (!(condition)) {                                                                                            \
            fprintf(stderr, "%s:%d: not so: %s\n", __FILE__, __LINE__, #condition);                                    \
            exit(EXIT_FAILURE);                                                                                        \
        }                                                                                                              \
    } while (0)

enum { MOST_FRAMES = 64, SLOTS = 1 << 16 };

typedef struct {
    uint8_t *bytes;
    size_t length;
    const char *path;
    size_t frames;
    size_t gaussians[MOST_FRAMES];
} Stream;

static void read_stream(Stream *stream, const char *path) {
    FILE *file = fopen(path, "rb");
    CHECK(file != NULL);
    CHECK(fseek(file, 0, SEEK_END) == 0);
    long length = ftell(file);
    CHECK(length > 0);
    rewind(file);
    *stream = (Stream){malloc((size_t)length), (size_t)length, path, 0, {0}};
    CHECK(stream->bytes != NULL);
    CHECK(fread(stream->bytes, 1, stream->length, file) == stream->length);
    fclose(file);
}

static void planes_are_finite(const SplatstreamPlanes *planes, size_t length) {
    CHECK(planes->length == length);
    for (size_t i = 0; i < length; i++) {
        float sum = planes->position[2][i] + planes->log_scale[2][i] + planes->rotation[3][i] + planes->dc[2][i];
        for (size_t plane = 0; plane < planes->sh_count; plane++)
            sum += planes->sh[plane][i];
        CHECK(isfinite(sum));
    }
}

// Reads the file, and keeps what the others compare with.
static void a_file_is_pulled(Stream *stream) {
    SplatstreamDecoder *decoder = splatstream_decoder_new();
    CHECK(splatstream_decoder_open(decoder, stream->path) == SPLATSTREAM_STATUS_OK);
    SplatstreamFrame frame;
    SplatstreamPlanes planes;
    while (splatstream_decoder_next_frame(decoder, &frame) == SPLATSTREAM_STATUS_OK) {
        CHECK(frame.index == stream->frames && frame.warnings == 0 && stream->frames < MOST_FRAMES);
        CHECK(splatstream_decoder_planes(decoder, &planes) == SPLATSTREAM_STATUS_OK);
        planes_are_finite(&planes, frame.gaussians);
        CHECK(splatstream_decoder_identities(decoder) != NULL);
        stream->gaussians[stream->frames++] = frame.gaussians;
    }
    CHECK(strcmp(splatstream_decoder_message(decoder), "") == 0);
    CHECK(splatstream_decoder_frame_count(decoder) == stream->frames && stream->frames > 1);
    CHECK(splatstream_decoder_identities(decoder) == NULL);
    CHECK(splatstream_decoder_next_frame(decoder, &frame) == SPLATSTREAM_STATUS_END);
    splatstream_decoder_free(decoder);
}

static void pushed_pieces_give_the_same_frames(const Stream *stream, size_t piece) {
    SplatstreamDecoder *decoder = splatstream_decoder_new();
    SplatstreamFrame frame;
    size_t frames = 0;
    SplatstreamStatus status = SPLATSTREAM_STATUS_NEED_BYTES;
    for (size_t at = 0; status == SPLATSTREAM_STATUS_NEED_BYTES; at += piece) {
        if (at < stream->length) {
            size_t length = at + piece < stream->length ? piece : stream->length - at;
            // A copy of its own shows when the decoder reads beyond it or later.
            uint8_t *copy = malloc(length);
            CHECK(copy != NULL);
            memcpy(copy, stream->bytes + at, length);
            CHECK(splatstream_decoder_push(decoder, copy, length) == SPLATSTREAM_STATUS_OK);
            free(copy);
        } else {
            CHECK(splatstream_decoder_end(decoder) == SPLATSTREAM_STATUS_OK);
        }
        while ((status = splatstream_decoder_next_frame(decoder, &frame)) == SPLATSTREAM_STATUS_OK)
            CHECK(frame.gaussians == stream->gaussians[frames++]);
    }
    CHECK(status == SPLATSTREAM_STATUS_END && frames == stream->frames);
    CHECK(splatstream_decoder_seek_frame(decoder, 0) == SPLATSTREAM_STATUS_NOT_SEEKABLE);
    splatstream_decoder_free(decoder);
}

static SplatstreamDecoder *opened(const Stream *stream) {
    SplatstreamDecoder *decoder = splatstream_decoder_new();
    CHECK(splatstream_decoder_open_bytes(decoder, stream->bytes, stream->length) == SPLATSTREAM_STATUS_OK);
    return decoder;
}

static void it_seeks(const Stream *stream) {
    SplatstreamDecoder *decoder = opened(stream);
    SplatstreamFrame frame;
    CHECK(splatstream_decoder_seek_frame(decoder, 1) == SPLATSTREAM_STATUS_OK);
    CHECK(splatstream_decoder_next_frame(decoder, &frame) == SPLATSTREAM_STATUS_OK && frame.index == 1);
    CHECK(splatstream_decoder_seek_time(decoder, frame.nanoseconds / 2) == SPLATSTREAM_STATUS_OK);
    CHECK(splatstream_decoder_next_frame(decoder, &frame) == SPLATSTREAM_STATUS_OK && frame.index == 0);
    uint8_t byte = 0;
    CHECK(splatstream_decoder_push(decoder, &byte, 1) == SPLATSTREAM_STATUS_NOT_PUSHED);
    splatstream_decoder_free(decoder);
}

static void a_lower_point_has_fewer_gaussians(const Stream *stream) {
    SplatstreamDecoder *decoder = splatstream_decoder_new();
    SplatstreamOperatingPoint point = {0, 0, 0};
    // It stays when something is opened.
    CHECK(splatstream_decoder_set_operating_point(decoder, point) == SPLATSTREAM_STATUS_OK);
    CHECK(splatstream_decoder_open_bytes(decoder, stream->bytes, stream->length) == SPLATSTREAM_STATUS_OK);
    SplatstreamFrame frame;
    CHECK(splatstream_decoder_next_frame(decoder, &frame) == SPLATSTREAM_STATUS_OK);
    CHECK(frame.refinements == 1 && frame.gaussians < stream->gaussians[0] && frame.point.refinement == 0);
    splatstream_decoder_free(decoder);
}

static void limits_are_kept(const Stream *stream) {
    SplatstreamDecoder *decoder = opened(stream);
    SplatstreamLimits limits = splatstream_limits_default();
    limits.max_memory = 1 << 20;
    CHECK(splatstream_decoder_set_limits(decoder, &limits) == SPLATSTREAM_STATUS_OK);
    CHECK(splatstream_decoder_next_frame(decoder, NULL) == SPLATSTREAM_STATUS_OVER_LIMIT);
    CHECK(strlen(splatstream_decoder_message(decoder)) > 0);
    CHECK(splatstream_decoder_set_limits(decoder, &limits) == SPLATSTREAM_STATUS_INVALID_ARGUMENT);
    splatstream_decoder_free(decoder);
}

static void it_is_cancelled_and_goes_on(const Stream *stream) {
    SplatstreamDecoder *decoder = opened(stream);
    SplatstreamCancel *cancel = splatstream_cancel_new();
    CHECK(splatstream_decoder_set_cancel(decoder, cancel) == SPLATSTREAM_STATUS_OK);
    splatstream_cancel_request(cancel);
    splatstream_cancel_free(cancel);
    CHECK(splatstream_decoder_next_frame(decoder, NULL) == SPLATSTREAM_STATUS_CANCELLED);
    CHECK(splatstream_decoder_set_cancel(decoder, NULL) == SPLATSTREAM_STATUS_OK);
    CHECK(splatstream_decoder_seek_frame(decoder, 0) == SPLATSTREAM_STATUS_OK);
    CHECK(splatstream_decoder_next_frame(decoder, NULL) == SPLATSTREAM_STATUS_OK);
    splatstream_decoder_free(decoder);
}

// Copying what is dirty keeps a renderer's buffer up to date.
static void slots_tell_what_changes(const Stream *stream) {
    SplatstreamDecoder *decoder = opened(stream);
    SplatstreamSlots *slots = splatstream_slots_new(SLOTS);
    SplatstreamUpdate update;
    SplatstreamPlanes planes;
    float *copy = calloc(SLOTS, sizeof *copy);
    CHECK(copy != NULL);
    for (size_t frame = 0; frame < stream->frames; frame++) {
        CHECK(splatstream_decoder_next_frame(decoder, NULL) == SPLATSTREAM_STATUS_OK);
        CHECK(splatstream_slots_update(slots, decoder, &update) == SPLATSTREAM_STATUS_OK);
        CHECK(update.kept + update.appeared == stream->gaussians[frame]);
        CHECK(splatstream_slots_planes(slots, &planes) == SPLATSTREAM_STATUS_OK);
        for (size_t i = 0; i < update.dirty_count; i++)
            for (size_t slot = update.dirty[i].begin; slot < update.dirty[i].end; slot++)
                copy[slot] = planes.position[0][slot];
        CHECK(memcmp(copy, planes.position[0], SLOTS * sizeof *copy) == 0);
        planes_are_finite(&planes, SLOTS);
        CHECK(splatstream_slots_find(slots, splatstream_decoder_identities(decoder)[0]) < SLOTS);
    }
    CHECK(splatstream_slots_find(slots, UINT32_MAX) == SIZE_MAX);
    SplatstreamSlots *few = splatstream_slots_new(1);
    CHECK(splatstream_slots_update(few, decoder, &update) == SPLATSTREAM_STATUS_TOO_FEW_SLOTS);
    CHECK(strlen(splatstream_slots_message(few)) > 0);
    splatstream_slots_free(few);
    splatstream_decoder_free(decoder);
    CHECK(splatstream_slots_planes(slots, &planes) == SPLATSTREAM_STATUS_OK);
    planes_are_finite(&planes, SLOTS);
    splatstream_slots_free(slots);
    free(copy);
}

static void damage_is_told(const Stream *stream) {
    size_t told = 0;
    uint8_t *damaged = malloc(stream->length);
    CHECK(damaged != NULL);
    for (size_t at = 0; at < stream->length; at += 501) {
        memcpy(damaged, stream->bytes, stream->length);
        damaged[at] ^= 0x5a;
        SplatstreamDecoder *decoder = splatstream_decoder_new();
        CHECK(splatstream_decoder_open_bytes(decoder, damaged, stream->length) == SPLATSTREAM_STATUS_OK);
        SplatstreamFrame frame;
        SplatstreamStatus status;
        size_t warnings = 0;
        while ((status = splatstream_decoder_next_frame(decoder, &frame)) == SPLATSTREAM_STATUS_OK) {
            for (size_t i = 0; i < frame.warnings; i++)
                warnings += strlen(splatstream_decoder_warning(decoder, i)) > 0;
            CHECK(splatstream_decoder_warning(decoder, frame.warnings) == NULL);
        }
        if (status == SPLATSTREAM_STATUS_INCOMPLETE)
            CHECK(strlen(splatstream_decoder_warning(decoder, 0)) > 0);
        CHECK(status == SPLATSTREAM_STATUS_END || strlen(splatstream_decoder_message(decoder)) > 0);
        CHECK(status != SPLATSTREAM_STATUS_INTERNAL);
        told += warnings > 0 || status != SPLATSTREAM_STATUS_END;
        splatstream_decoder_free(decoder);
    }
    CHECK(told > 0);
    free(damaged);
    SplatstreamDecoder *decoder = splatstream_decoder_new();
    CHECK(splatstream_decoder_open_bytes(decoder, stream->bytes, 3) == SPLATSTREAM_STATUS_OK);
    CHECK(splatstream_decoder_next_frame(decoder, NULL) == SPLATSTREAM_STATUS_TRUNCATED);
    splatstream_decoder_free(decoder);
}

static void misuse_is_an_error(void) {
    SplatstreamStatus const wrong = SPLATSTREAM_STATUS_INVALID_ARGUMENT;
    SplatstreamOperatingPoint point = {0, 0, 0};
    SplatstreamPlanes planes;
    SplatstreamUpdate update;
    CHECK(splatstream_decoder_next_frame(NULL, NULL) == wrong);
    CHECK(splatstream_decoder_open(NULL, "in") == wrong);
    CHECK(splatstream_decoder_set_operating_point(NULL, point) == wrong);
    CHECK(strlen(splatstream_decoder_message(NULL)) > 0 && strlen(splatstream_slots_message(NULL)) > 0);
    CHECK(splatstream_decoder_identities(NULL) == NULL && splatstream_decoder_warning(NULL, 0) == NULL);
    CHECK(splatstream_decoder_frame_count(NULL) == 0 && splatstream_slots_find(NULL, 0) == SIZE_MAX);
    CHECK(splatstream_slots_new(SIZE_MAX) == NULL);
    splatstream_cancel_request(NULL);
    SplatstreamDecoder *decoder = splatstream_decoder_new();
    SplatstreamSlots *slots = splatstream_slots_new(0);
    CHECK(splatstream_decoder_open(decoder, NULL) == wrong);
    CHECK(splatstream_decoder_open(decoder, "there is no such file") == SPLATSTREAM_STATUS_IO);
    CHECK(splatstream_decoder_set_limits(decoder, NULL) == wrong);
    CHECK(splatstream_decoder_push(decoder, NULL, 1) == wrong);
    CHECK(splatstream_decoder_push(decoder, NULL, 0) == SPLATSTREAM_STATUS_OK);
    CHECK(splatstream_decoder_planes(decoder, &planes) == wrong);
    CHECK(splatstream_slots_update(slots, decoder, &update) == wrong);
    CHECK(splatstream_slots_update(slots, NULL, &update) == wrong);
    CHECK(splatstream_slots_planes(slots, NULL) == wrong);
    CHECK(splatstream_decoder_next_frame(decoder, NULL) == SPLATSTREAM_STATUS_NEED_BYTES);
    CHECK(splatstream_decoder_end(decoder) == SPLATSTREAM_STATUS_OK);
    CHECK(splatstream_decoder_push(decoder, NULL, 0) == SPLATSTREAM_STATUS_NOT_PUSHED);
    splatstream_decoder_free(decoder);
    splatstream_slots_free(slots);
    splatstream_decoder_free(NULL);
    splatstream_slots_free(NULL);
    splatstream_cancel_free(NULL);
}

int main(int count, char **arguments) {
    CHECK(count == 2 && splatstream_abi_version() == SPLATSTREAM_ABI_VERSION);
    Stream stream;
    read_stream(&stream, arguments[1]);
    a_file_is_pulled(&stream);
    pushed_pieces_give_the_same_frames(&stream, 100);
    pushed_pieces_give_the_same_frames(&stream, stream.length);
    it_seeks(&stream);
    a_lower_point_has_fewer_gaussians(&stream);
    limits_are_kept(&stream);
    it_is_cancelled_and_goes_on(&stream);
    slots_tell_what_changes(&stream);
    damage_is_told(&stream);
    misuse_is_an_error();
    free(stream.bytes);
    printf("the C interface: %zu frames, all as it should be\n", stream.frames);
    return EXIT_SUCCESS;
}
