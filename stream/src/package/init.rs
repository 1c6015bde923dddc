//! C.4: the initialisation segment of a Representation.

use super::Clock;
use crate::boxes::write::{put, put_full, u16s, u32s, u64};
use crate::representation::Representation;

/// What an initialisation segment says.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Init<'a> {
    /// Whose it is.
    pub(crate) representation: Representation,
    /// Tracks, one for each refinement.
    pub(crate) refinements: u8,
    /// The units of the time.
    pub(crate) clock: Clock,
    /// The file header and the units before the first GOP.
    pub(crate) head: &'a [u8],
}

/// The unity matrix of 14496-12.
const MATRIX: [u32; 9] = [0x1_0000, 0, 0, 0, 0x1_0000, 0, 0, 0, 0x4000_0000];
/// `und` in three letters of 5 bits.
const UNDETERMINED: u16 = 0x55C4;
/// The sample entry has this many bytes for a name of the compressor.
const COMPRESSOR: [u8; 32] = *b"\x0bSplatStream\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0";
/// Enabled, in the movie.
const TRACK_FLAGS: u32 = 3;
/// `sample_depends_on` of `default_sample_flags`: 2 is on nothing, 1 is on others, which no random access starts with.
const INDEPENDENT: u32 = 2 << 24;
const DEPENDENT: u32 = 1 << 24 | 1 << 16;

impl Init<'_> {
    /// The bytes.
    pub(crate) fn to_bytes(self) -> Vec<u8> {
        let mut out = Vec::new();
        put_brands(&mut out, *b"ftyp", &[*b"iso6", *b"dash", *b"msix", *b"gss1"]);
        put(&mut out, *b"moov", |out| {
            self.movie_header(out);
            for refinement in 0..self.refinements {
                self.track(out, refinement);
            }
            put(out, *b"mvex", |out| self.extends(out));
        });
        out
    }

    fn movie_header(self, out: &mut Vec<u8>) {
        put_full(out, *b"mvhd", 0, 0, |out| {
            u32s(out, &[0, 0, self.clock.timescale, 0, 0x1_0000, 0x0100_0000, 0, 0]);
            u32s(out, &MATRIX);
            u32s(out, &[0; 6]);
            u32s(out, &[u32::from(self.refinements).saturating_add(1)]);
        });
    }

    fn track(self, out: &mut Vec<u8>, refinement: u8) {
        let id = track_id(refinement);
        put(out, *b"trak", |out| {
            put_full(out, *b"tkhd", 0, TRACK_FLAGS, |out| {
                u32s(out, &[0, 0, id, 0, 0, 0, 0, 0, 0]);
                u32s(out, &MATRIX);
                u32s(out, &[0, 0]);
            });
            if refinement > 0 {
                put(out, *b"tref", |out| put(out, *b"sbas", |out| u32s(out, &[id.saturating_sub(1)])));
            }
            put(out, *b"mdia", |out| self.media(out, refinement));
        });
    }

    fn media(self, out: &mut Vec<u8>, refinement: u8) {
        put_full(out, *b"mdhd", 0, 0, |out| {
            u32s(out, &[0, 0, self.clock.timescale, 0]);
            u16s(out, &[UNDETERMINED, 0]);
        });
        put_full(out, *b"hdlr", 0, 0, |out| {
            u32s(out, &[0]);
            out.extend(b"volv");
            u32s(out, &[0; 3]);
            out.extend(b"SplatStream\0");
        });
        put(out, *b"minf", |out| {
            put_full(out, *b"vvhd", 0, 0, |_| {});
            put(out, *b"dinf", |out| {
                put_full(out, *b"dref", 0, 0, |out| {
                    u32s(out, &[1]);
                    put_full(out, *b"url ", 0, 1, |_| {});
                });
            });
            put(out, *b"stbl", |out| self.samples(out, refinement));
        });
    }

    fn samples(self, out: &mut Vec<u8>, refinement: u8) {
        put_full(out, *b"stsd", 0, 0, |out| {
            u32s(out, &[1]);
            put(out, *b"gss1", |out| {
                u16s(out, &[0, 0, 0, 1]);
                out.extend(COMPRESSOR);
                self.configuration(out, refinement);
            });
        });
        put_full(out, *b"stts", 0, 0, |out| u32s(out, &[0]));
        put_full(out, *b"stsc", 0, 0, |out| u32s(out, &[0]));
        put_full(out, *b"stsz", 0, 0, |out| u32s(out, &[0, 0]));
        put_full(out, *b"stco", 0, 0, |out| u32s(out, &[0]));
    }

    fn configuration(self, out: &mut Vec<u8>, refinement: u8) {
        put_full(out, *b"gssC", 0, 0, |out| {
            let (kind, layer) = self.representation.codes();
            out.extend([kind, layer, refinement, self.refinements]);
            if refinement == 0 {
                out.extend_from_slice(self.head);
            }
        });
    }

    fn extends(self, out: &mut Vec<u8>) {
        let flags = if self.representation.is_intra() { INDEPENDENT } else { DEPENDENT };
        for refinement in 0..self.refinements {
            put_full(out, *b"trex", 0, 0, |out| u32s(out, &[track_id(refinement), 1, 0, 0, flags]));
        }
        if self.refinements < 2 {
            return;
        }
        put_full(out, *b"leva", 0, 0, |out| {
            out.push(self.refinements);
            for refinement in 0..self.refinements {
                u32s(out, &[track_id(refinement)]);
                // No padding; assignment_type 3.
                out.push(3);
            }
        });
    }
}

/// Appends `ftyp` or `styp`; the first brand is the major one.
pub(crate) fn put_brands(out: &mut Vec<u8>, kind: [u8; 4], brands: &[[u8; 4]]) {
    put(out, kind, |out| {
        out.extend(brands.first().copied().unwrap_or_default());
        u32s(out, &[0]);
        brands.iter().for_each(|brand| out.extend(brand));
    });
}

/// The track of a refinement, which is also its level.
pub(crate) fn track_id(refinement: u8) -> u32 {
    u32::from(refinement).saturating_add(1)
}

/// Appends the box of the units after the last GOP.
pub(crate) fn put_tail(out: &mut Vec<u8>, tail: &[u8]) {
    put_full(out, *b"gssT", 0, 0, |out| out.extend_from_slice(tail));
}

/// Appends an index of subsegments, C.5.2. `first_offset` is the number of bytes between it and the first of them; a
/// reference is size, duration, and whether the subsegment is an access point.
pub(crate) fn put_index(
    out: &mut Vec<u8>,
    clock: Clock,
    start: u64,
    first_offset: u64,
    references: &[(u32, u32, bool)],
) {
    put_full(out, *b"sidx", 1, 0, |out| {
        u32s(out, &[1, clock.timescale]);
        u64(out, start);
        u64(out, first_offset);
        u16s(out, &[0, u16::try_from(references.len()).unwrap_or(u16::MAX)]);
        for &(size, duration, is_access_point) in references {
            // starts_with_SAP, SAP_type 1.
            let access = if is_access_point { 1 << 31 | 1 << 28 } else { 0 };
            u32s(out, &[size, duration, access]);
        }
    });
}
