// Decodes SplatStream streams: dynamic 3D Gaussian splatting.
//
// A handle comes from a function whose name ends with _new, and goes to the one that ends with _free. One thread at a
// time uses a handle, whichever; SplatstreamCancel may be used by several. Every pointer that a function takes must be
// a live handle, or point to as much memory as the function says; a null pointer instead gives
// SPLATSTREAM_STATUS_INVALID_ARGUMENT. Memory that a function gives belongs to its handle, and lasts as long as the
// function says.
//
// A function that can fail returns a status; what was wrong is told in words by splatstream_decoder_message or
// splatstream_slots_message. No input ends the program.
//
// Push: splatstream_decoder_new, then splatstream_decoder_push and splatstream_decoder_next_frame until that says
// SPLATSTREAM_STATUS_END, with splatstream_decoder_end after the last bytes. Pull: splatstream_decoder_open or
// splatstream_decoder_open_bytes, then splatstream_decoder_next_frame.
//
// Generated from src/: see tests/header.rs. Do not edit.

#ifndef SPLATSTREAM_H
#define SPLATSTREAM_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

// The version of this interface: of its functions, structures and values.
#define SPLATSTREAM_ABI_VERSION 1

// What a call has come to. Later versions of the library may add values.
typedef enum SplatstreamStatus {
  // Done. Of splatstream_decoder_next_frame: there is a frame.
  SPLATSTREAM_STATUS_OK = 0,
  // The next frame needs more bytes: push them, or say that there are none.
  SPLATSTREAM_STATUS_NEED_BYTES = 1,
  // There are no more frames.
  SPLATSTREAM_STATUS_END = 2,
  // The stream does not parse.
  SPLATSTREAM_STATUS_MALFORMED = 10,
  // The stream parses, and breaks a rule of the specification.
  SPLATSTREAM_STATUS_INVALID = 11,
  // The stream has a feature that this version does not decode.
  SPLATSTREAM_STATUS_UNSUPPORTED = 12,
  // The stream needs more than the limits allow.
  SPLATSTREAM_STATUS_OVER_LIMIT = 13,
  // The stream ends too early.
  SPLATSTREAM_STATUS_TRUNCATED = 14,
  // All frames that are left have been given; after the last one something was lost, which warnings tell.
  SPLATSTREAM_STATUS_INCOMPLETE = 20,
  // A file cannot be opened or read, or there is no memory.
  SPLATSTREAM_STATUS_IO = 21,
  // The work was cancelled. Seeking starts again.
  SPLATSTREAM_STATUS_CANCELLED = 22,
  // More bytes would wait in the decoder than the limits allow: take frames first.
  SPLATSTREAM_STATUS_TOO_MUCH_INPUT = 23,
  // Bytes were pushed after the end, or to a decoder that reads by itself.
  SPLATSTREAM_STATUS_NOT_PUSHED = 24,
  // A decoder that bytes are pushed to cannot seek.
  SPLATSTREAM_STATUS_NOT_SEEKABLE = 25,
  // A frame has more Gaussians than there are slots, which are as they were.
  SPLATSTREAM_STATUS_TOO_FEW_SLOTS = 26,
  // A null pointer where there must be none, a call that is too late, or before there is a frame.
  SPLATSTREAM_STATUS_INVALID_ARGUMENT = 30,
  // A defect of the library. The handle can only be freed.
  SPLATSTREAM_STATUS_INTERNAL = 31,
} SplatstreamStatus;

// Ends the work of decoders, also within a frame. Threads may share it.
typedef struct SplatstreamCancel SplatstreamCancel;

// Decodes a stream.
typedef struct SplatstreamDecoder SplatstreamDecoder;

// Planes of a fixed number of slots. A Gaussian has the same slot in every frame from the one that it appears in to the one
// that it disappears in; a slot without a Gaussian has opacity 0 (its logit is minus infinity) and is 0 otherwise.
typedef struct SplatstreamSlots SplatstreamSlots;

// What a decoder may take. It refuses a stream that asks for more before it allocates anything.
typedef struct SplatstreamLimits {
  // Bytes that are held at the same time, for planes, frames that later ones refer to, and input that waits.
  uint64_t max_memory;
  // Gaussians of all frames together.
  uint64_t max_total_gaussians;
  // Bytes of all frames together as planes of float.
  uint64_t max_output;
  // Work on all frames together: values that are decoded, moved, hashed or predicted. A core does some 10^8 a second.
  uint64_t max_work;
  // Gaussians of a frame.
  uint32_t max_gaussians;
  // Bytes of a unit, of which a frame has one for each refinement and layer.
  uint32_t max_unit;
} SplatstreamLimits;

// Which units of a stream are decoded. What the stream does not have is not missed: 255 on all axes takes everything.
typedef struct SplatstreamOperatingPoint {
  // Highest spatial layer.
  uint8_t spatial;
  // Highest temporal layer.
  uint8_t temporal;
  // Highest refinement.
  uint8_t refinement;
} SplatstreamOperatingPoint;

// A frame.
typedef struct SplatstreamFrame {
  // When it is shown, from the start of the stream.
  uint64_t nanoseconds;
  // How many Gaussians it has.
  size_t gaussians;
  // How many of these, the last ones, are those of an earlier frame, moved: they stand in for refinements that are not
  // there.
  size_t carried;
  // How many warnings there are: see splatstream_decoder_warning.
  size_t warnings;
  // Its number in the order in which frames are shown, from 0.
  uint32_t index;
  // The operating point that it was decoded at.
  struct SplatstreamOperatingPoint point;
  // How many refinements it shows exactly. Fewer than the operating point asks for if some are missing.
  uint8_t refinements;
  // Whether it refers to no other frame.
  bool is_keyframe;
} SplatstreamFrame;

// Gaussians as planes: value i of each plane belongs to Gaussian i, or to slot i.
typedef struct SplatstreamPlanes {
  // Values of each plane.
  size_t length;
  // Centre: x right, y down, z forward, in the unit of the scene.
  const float *position[3];
  // Natural logarithm of the standard deviation along each axis of the Gaussian.
  const float *log_scale[3];
  // Unit quaternion w, x, y, z.
  const float *rotation[4];
  // Opacity before the sigmoid function.
  const float *opacity_logit;
  // Coefficient of degree 0 of the spherical harmonics, of red, green and blue: colour = 0.5 + 0.2821 dc.
  const float *dc[3];
  // Coefficients of degree 1 and up of the spherical harmonics: of the first coefficient red, green and blue, then of
  // the next.
  const float *const *sh;
  // How many planes sh has: 0, 9, 24 or 45.
  size_t sh_count;
} SplatstreamPlanes;

// A run of slots.
typedef struct SplatstreamRange {
  // The first.
  size_t begin;
  // The one after the last.
  size_t end;
} SplatstreamRange;

// What a frame has changed.
typedef struct SplatstreamUpdate {
  // Runs of slots of which some plane has another value than before, increasing: what a renderer copies. They last until
  // the next update.
  const struct SplatstreamRange *dirty;
  // How many runs there are.
  size_t dirty_count;
  // Gaussians that keep their slot.
  size_t kept;
  // Gaussians that have appeared.
  size_t appeared;
  // Gaussians that have disappeared.
  size_t disappeared;
  // The degree of the spherical harmonics has changed: there are more or fewer planes.
  bool has_new_planes;
} SplatstreamUpdate;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// The version of the interface that the library has. A program that was compiled with another
// SPLATSTREAM_ABI_VERSION must not call anything else.
uint32_t splatstream_abi_version(void);

// The limits of a new decoder, which are for a server that decodes what strangers send: 2 GiB of memory, 4 Mi Gaussians
// in a frame, 2^28 in all, 32 GiB of output, and some minutes of work for a core. A program that changes some starts with
// these. A player of streams of any length sets the three totals to UINT64_MAX.
struct SplatstreamLimits splatstream_limits_default(void);

// For splatstream_decoder_set_cancel.
struct SplatstreamCancel *splatstream_cancel_new(void);

// Ends the work of all decoders that have been given this, for good: they return SPLATSTREAM_STATUS_CANCELLED.
void splatstream_cancel_request(const struct SplatstreamCancel *cancel);

// Frees it, or does nothing if it is null. Decoders that have been given it go on.
void splatstream_cancel_free(struct SplatstreamCancel *cancel);

// A decoder that bytes are pushed to, unless it opens something. Null if there is no memory.
struct SplatstreamDecoder *splatstream_decoder_new(void);

// Frees a decoder, or does nothing if it is null. Slots may be used further.
void splatstream_decoder_free(struct SplatstreamDecoder *decoder);

// What was wrong with the last call that returned a status, as text in English, or an empty text. It lasts until the
// next call.
const char *splatstream_decoder_message(const struct SplatstreamDecoder *decoder);

// Decodes a file, which is read as it is needed. `path` ends with a zero; its encoding is UTF-8, on Unix that of the
// file system. Limits, operating point and cancellation stay as they have been set, whatever was decoded before.
enum SplatstreamStatus splatstream_decoder_open(struct SplatstreamDecoder *decoder,
                                                const char *path);

// Decodes a stream in memory, of which the decoder keeps a copy. Otherwise as splatstream_decoder_open.
enum SplatstreamStatus splatstream_decoder_open_bytes(struct SplatstreamDecoder *decoder,
                                                      const uint8_t *bytes,
                                                      size_t length);

// Sets limits. To be called before bytes or frames are taken.
enum SplatstreamStatus splatstream_decoder_set_limits(struct SplatstreamDecoder *decoder,
                                                      const struct SplatstreamLimits *limits);

// Sets the operating point, which is everything at first: from the next GOP (group of pictures) on, and where it is lower
// on some axis, from the next frame on.
enum SplatstreamStatus splatstream_decoder_set_operating_point(struct SplatstreamDecoder *decoder,
                                                               struct SplatstreamOperatingPoint point);

// Lets another thread end the work of this decoder. Null takes that back, after a cancellation too: then seek.
enum SplatstreamStatus splatstream_decoder_set_cancel(struct SplatstreamDecoder *decoder,
                                                      const struct SplatstreamCancel *cancel);

// Takes the next bytes of the stream, which are copied. After the last frame they are ignored.
enum SplatstreamStatus splatstream_decoder_push(struct SplatstreamDecoder *decoder,
                                                const uint8_t *bytes,
                                                size_t length);

// No more bytes will be pushed: a frame that lacks some is given.
enum SplatstreamStatus splatstream_decoder_end(struct SplatstreamDecoder *decoder);

// Decodes the next frame. SPLATSTREAM_STATUS_OK: it is described in `frame`, unless that is null, and stays in the decoder
// until the next call of this function, of one that seeks or opens, or of splatstream_decoder_set_limits. After
// SPLATSTREAM_STATUS_NEED_BYTES push more; after SPLATSTREAM_STATUS_END and all errors nothing comes any more.
// SPLATSTREAM_STATUS_INCOMPLETE stands in for SPLATSTREAM_STATUS_END where something was lost after the last frame.
enum SplatstreamStatus splatstream_decoder_next_frame(struct SplatstreamDecoder *decoder,
                                                      struct SplatstreamFrame *frame);

// The Gaussians of the frame, most important first within each refinement. They last as long as the frame.
enum SplatstreamStatus splatstream_decoder_planes(struct SplatstreamDecoder *decoder,
                                                  struct SplatstreamPlanes *planes);

// The identity of each Gaussian of the frame: the same in two frames for the same Gaussian. Null if there is no frame. They
// last as long as the frame.
const uint32_t *splatstream_decoder_identities(const struct SplatstreamDecoder *decoder);

// What was lost between the frame before and this one, or after the last one, as text in English: the warning with this
// number, from 0. Null if there are not so many. It lasts as long as the frame.
const char *splatstream_decoder_warning(const struct SplatstreamDecoder *decoder,
                                        size_t number);

// Frames in the stream, if this is known: after the first frame, of streams that say it. Otherwise 0.
uint32_t splatstream_decoder_frame_count(const struct SplatstreamDecoder *decoder);

// Goes to a frame: the next one has this index, or a higher one where that is missing. Not for bytes that are pushed. This
// works after the end and after errors too.
enum SplatstreamStatus splatstream_decoder_seek_frame(struct SplatstreamDecoder *decoder,
                                                      uint32_t index);

// Goes to the frame that is shown at a time from the start of the stream. Otherwise as splatstream_decoder_seek_frame.
enum SplatstreamStatus splatstream_decoder_seek_time(struct SplatstreamDecoder *decoder,
                                                     uint64_t nanoseconds);

// Slots for frames of at most so many Gaussians. Null if no stream can have so many, or there is no memory.
struct SplatstreamSlots *splatstream_slots_new(size_t capacity);

// Frees slots, or does nothing if they are null.
void splatstream_slots_free(struct SplatstreamSlots *slots);

// What was wrong with the last call that returned a status, as text in English, or an empty text. It lasts until the
// next call.
const char *splatstream_slots_message(const struct SplatstreamSlots *slots);

// Shows the frame of a decoder in the slots.
enum SplatstreamStatus splatstream_slots_update(struct SplatstreamSlots *slots,
                                                const struct SplatstreamDecoder *decoder,
                                                struct SplatstreamUpdate *update);

// The planes, whose length is the capacity. They last until the next update.
enum SplatstreamStatus splatstream_slots_planes(struct SplatstreamSlots *slots,
                                                struct SplatstreamPlanes *planes);

// The slot of the Gaussian with an identity; SIZE_MAX if it is not in the last frame.
size_t splatstream_slots_find(const struct SplatstreamSlots *slots, uint32_t identity);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* SPLATSTREAM_H */
