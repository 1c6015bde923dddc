//! `.ksplat` files of what an input says: headers without their zeros, and bodies that fit.

use super::bytes::{Bytes, repeated};

/// Bits of the first byte: buckets fit the Gaussians, and the header of the file has their number.
const FITS: u8 = 1;

/// More Gaussians than these are claimed, not there.
const MAX_GAUSSIANS: u32 = 1 << 8;

/// Flags, version, level and sections; the number of Gaussians; of each section a count, room for more, a bucket, its degree and
/// its lacking bytes; the body.
pub fn pack(input: &[u8]) -> Vec<u8> {
    let mut input = Bytes(input);
    let [flags, version, level, sections] = input.array();
    let gaussians = u32::from_le_bytes(input.array());
    let sections: Vec<Section> = (0..sections % 5).map(|_| Section::of(&mut input)).collect();
    let fits = flags & FITS != 0;
    let sum = sections.iter().fold(0, |sum: u32, section| sum.saturating_add(section.count));
    let mut header = vec![0; 4096];
    header[1] = version;
    put(&mut header, 4, sections.len() as u32);
    put(&mut header, 16, if fits { sum } else { gaussians });
    put(&mut header, 20, u32::from(level % 4));
    let mut out = header;
    let level = usize::from(level % 3);
    sections.iter().for_each(|section| out.extend(section.header(level, fits)));
    for section in &sections {
        let (full, partial, rest) = section.buckets(level);
        (0..partial).for_each(|_| out.extend(rest.to_le_bytes()));
        let size =
            (full + partial) * 12 + section.stride(level) * (section.count + section.more).min(MAX_GAUSSIANS);
        out.extend(repeated(input.0, (size as usize).saturating_sub(section.lacking)));
    }
    out
}

fn put(to: &mut [u8], at: usize, value: u32) {
    to[at..at + 4].copy_from_slice(&value.to_le_bytes());
}

struct Section {
    count: u32,
    more: u32,
    bucket: u32,
    degree: u32,
    lacking: usize,
}

impl Section {
    fn of(input: &mut Bytes<'_>) -> Self {
        let [count, power, more, bucket, degree, lacking] = input.array();
        Self {
            count: u32::from(count) << (power % 24),
            more: more.into(),
            bucket: bucket.into(),
            degree: u32::from(degree % 5),
            lacking: lacking.into(),
        }
    }

    /// Buckets that are full and those that are not, and what one of these has.
    fn buckets(&self, level: usize) -> (u32, u32, u32) {
        if level == 0 || self.bucket == 0 {
            return (0, 0, 0);
        }
        let count = self.count.min(MAX_GAUSSIANS);
        (count / self.bucket, u32::from(!count.is_multiple_of(self.bucket)), count % self.bucket)
    }

    fn stride(&self, level: usize) -> u32 {
        let coefficients = 3 * [0, 3, 8, 15, 15][self.degree as usize];
        [44 + 4 * coefficients, 24 + 2 * coefficients, 24 + coefficients][level]
    }

    fn header(&self, level: usize, fits: bool) -> Vec<u8> {
        let (full, partial, _) = self.buckets(level);
        let mut header = vec![0; 1024];
        let all = if fits { full + partial } else { self.bucket };
        let fields = [
            (0, self.count),
            (4, self.count.saturating_add(self.more)),
            (8, self.bucket),
            (12, all),
            (16, 5.0_f32.to_bits()),
            (20, 12),
            (32, full),
            (36, partial),
            (40, self.degree),
        ];
        fields.into_iter().for_each(|(at, value)| put(&mut header, at, value));
        header
    }
}
