/* The conformance protocol in C99. Fill in decode(); the rest is the protocol.
 *
 *   adapter IN.gss OP MODE OUT    one stream; the exit code is the verdict
 *   adapter --stdio               many: lines `in TAB op TAB mode TAB out`, answered with `exit-code`
 *
 *   cc -std=c99 -O2 -o adapter adapter.c
 */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Clause 9.1. */
enum verdict { ACCEPT = 0, MALFORMED = 10, INVALID = 11, UNSUPPORTED = 12, OVER_LIMIT = 13, TRUNCATED = 14 };

/* What is asked: units up to these layers (7.2), frames as subsets (7.8.2), a stream that starts inside another one (B.3). */
struct request {
    const uint8_t *stream;
    size_t bytes;
    unsigned op_s, op_t, op_r;
    int subset, inside;
    const char *out; /* where write_attribute() puts files */
};

static int write_attribute(const struct request *request, uint32_t frame, const char *attribute,
                           const int32_t *const *planes, size_t plane_count, size_t gaussian_count);

/* Your decoder. Of every frame that is shown, call write_attribute() once for each attribute:
 *
 *   position 3 planes, log_scale 3, opacity 1, rotation 3, dc 3, sh S (only if S > 0)
 *
 * with the canonical planes of 7.9, Gaussians in the order of 7.8.2, log_scale and opacity compensated (7.8.3).
 * Frames without Gaussians have empty files. Frames before and after an error are written too. With `inside`, next_gop and
 * next_frame come from the first gop_header, and nothing is compared with the stream as a whole. */
static enum verdict decode(const struct request *request)
{
    (void)request;
    (void)write_attribute;
    return UNSUPPORTED;
}

/* Writes planes one after the other, i32 little-endian; 0 if that worked. `frame` is the display index. */
static int write_attribute(const struct request *request, uint32_t frame, const char *attribute,
                           const int32_t *const *planes, size_t plane_count, size_t gaussian_count)
{
    char path[4096];
    int length = snprintf(path, sizeof path, "%s/f%04" PRIu32 ".%s.i32", request->out, frame, attribute);
    if (length < 0 || (size_t)length >= sizeof path) return -1;
    FILE *file = fopen(path, "wb");
    if (file == NULL) return -1;
    int failed = 0;
    for (size_t plane = 0; plane < plane_count; plane++) {
        for (size_t gaussian = 0; gaussian < gaussian_count; gaussian++) {
            uint32_t value = (uint32_t)planes[plane][gaussian];
            uint8_t bytes[4] = {(uint8_t)value, (uint8_t)(value >> 8), (uint8_t)(value >> 16), (uint8_t)(value >> 24)};
            failed |= fwrite(bytes, 1, 4, file) != 4;
        }
    }
    failed |= fclose(file) != 0;
    return failed ? -1 : 0;
}

/* The bytes of a file, to be freed; NULL if it cannot be read. */
static uint8_t *read_file(const char *path, size_t *bytes)
{
    FILE *file = fopen(path, "rb");
    if (file == NULL) return NULL;
    uint8_t *content = NULL;
    long length = fseek(file, 0, SEEK_END) == 0 ? ftell(file) : -1;
    if (length >= 0 && fseek(file, 0, SEEK_SET) == 0) {
        content = malloc((size_t)length + 1);
        *bytes = (size_t)length;
        if (content != NULL && fread(content, 1, *bytes, file) != *bytes) {
            free(content);
            content = NULL;
        }
    }
    fclose(file);
    return content;
}

/* Decodes a file as asked; 1, which no verdict is, if it cannot be. */
static int answer(const char *in, const char *op, const char *mode, const char *out)
{
    struct request request = {0};
    if (sscanf(op, "s%u,t%u,r%u", &request.op_s, &request.op_t, &request.op_r) != 3) return 1;
    uint8_t *stream = read_file(in, &request.bytes);
    if (stream == NULL) return 1;
    request.stream = stream;
    request.subset = strcmp(mode, "subset") == 0;
    request.inside = strcmp(mode, "inside") == 0;
    request.out = out;
    int verdict = decode(&request);
    free(stream);
    return verdict;
}

/* Cuts the next field off a line. */
static char *field(char **line)
{
    char *start = *line;
    char *end = start + strcspn(start, "\t\r\n");
    *line = *end == '\0' ? end : end + 1;
    *end = '\0';
    return start;
}

int main(int argc, char **argv)
{
    if (argc == 2 && strcmp(argv[1], "--stdio") == 0) {
        char buffer[16384];
        while (fgets(buffer, sizeof buffer, stdin) != NULL) {
            char *line = buffer;
            char *in = field(&line), *op = field(&line), *mode = field(&line), *out = field(&line);
            printf("%d\n", answer(in, op, mode, out));
            fflush(stdout);
        }
        return 0;
    }
    if (argc != 5) {
        fprintf(stderr, "usage: %s IN OP MODE OUT, or --stdio\n", argv[0]);
        return 2;
    }
    return answer(argv[1], argv[2], argv[3], argv[4]);
}
