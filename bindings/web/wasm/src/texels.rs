//! Gaussians as the renderer's textures hold them: texels of four 32-bit words, [`ROW`] Gaussians in a row of a texture.
//!
//! | word | of a Gaussian |
//! |---|---|
//! | 0 to 2 | position, binary32 |
//! | 3 | log-scales of axes 0 and 1, 16 bits each: (value + 32) * 1024 |
//! | 4 | log-scale of axis 2, and in the high half opacity: 0 is 0, 65535 is 1 |
//! | 5 | rotation: two of the three smaller components, 15 bits each, and in bits 30 and 31 which one (w, x, y, z) is the largest |
//! | 6 | the last of the smaller components, 16 bits, and in the high half red, binary16 |
//! | 7 | green and blue, binary16 |
//!
//! Colours are those of degree 0: 0.5 + 0.2821 dc. The smaller components of the rotation keep their order; they are
//! scaled from -1/√2 ... 1/√2 to all codes, for the sign with which the largest one is positive. The texture of the
//! spherical harmonics has two binary16 in a word, in the order of the planes, filled with 0 to whole texels.

use core::ops::Range;
use splatstream::Planes;

/// Gaussians in a row of a texture.
pub const ROW: usize = 512;
/// Words of a texel.
const TEXEL: usize = 4;
/// Words of a Gaussian without spherical harmonics.
const WORDS: usize = 2 * TEXEL;
/// The constant basis function of the spherical harmonics, 1 / (2 √π).
const SH_C0: f32 = 0.282_094_8;

/// The texels of all slots.
#[derive(Default)]
pub struct Texels {
    /// Geometry and colour of degree 0.
    pub base: Texture,
    /// Spherical harmonics; empty at degree 0.
    pub sh: Texture,
}

/// A texture and what has changed in it.
#[derive(Default)]
pub struct Texture {
    /// Texels, row by row.
    pub words: Vec<u32>,
    /// Rows that have changed, as first row and row after the last, increasing.
    pub dirty: Vec<u32>,
    /// Words of a Gaussian.
    stride: usize,
}

impl Texture {
    fn resize(&mut self, gaussians: usize, stride: usize) {
        self.stride = stride;
        self.words.clear();
        self.words.resize(gaussians * stride, 0);
    }

    /// Writes a Gaussian; whether that changes it.
    fn write(&mut self, slot: usize, words: &[u32]) -> bool {
        let at = slot * self.stride;
        let Some(place) = self.words.get_mut(at..at + words.len()) else { return false };
        let is_new = *place != *words;
        place.copy_from_slice(words);
        is_new
    }

    /// Adds a row, at or after the last one, to those that have changed.
    fn mark(&mut self, row: u32) {
        match self.dirty.last_mut() {
            Some(end) if *end >= row => *end = row + 1,
            _ => self.dirty.extend([row, row + 1]),
        }
    }

    fn mark_all(&mut self) {
        let rows = self.words.len().checked_div(self.stride * ROW).unwrap_or(0);
        self.dirty.clear();
        if rows > 0 {
            self.dirty.extend([0, rows as u32]);
        }
    }
}

impl Texels {
    /// Words of the spherical harmonics of a Gaussian, in whole texels.
    pub fn sh_words(planes: usize) -> usize {
        planes.div_ceil(2).next_multiple_of(TEXEL)
    }

    /// Writes the slots of some ranges, increasing. With `is_new`, the number of slots or of planes has changed, and
    /// everything counts as changed.
    pub fn write(&mut self, planes: &Planes, ranges: &[Range<usize>], is_new: bool) {
        if is_new {
            let slots = planes.opacity_logit.len();
            self.base.resize(slots, WORDS);
            self.sh.resize(slots, Self::sh_words(planes.sh.len()));
        }
        self.base.dirty.clear();
        self.sh.dirty.clear();
        let stride = self.sh.stride;
        let mut harmonics = [0; 24];
        for slot in ranges.iter().cloned().flatten() {
            let row = (slot / ROW) as u32;
            if self.base.write(slot, &base(planes, slot)) {
                self.base.mark(row);
            }
            if let Some(words) = harmonics.get_mut(..stride).filter(|words| !words.is_empty()) {
                pack_sh(planes, slot, words);
                if self.sh.write(slot, words) {
                    self.sh.mark(row);
                }
            }
        }
        if is_new {
            self.base.mark_all();
            self.sh.mark_all();
        }
    }
}

/// The words of a slot.
fn base(planes: &Planes, slot: usize) -> [u32; WORDS] {
    let of = |plane: &Vec<f32>| plane.get(slot).copied().unwrap_or_default();
    let [x, y, z] = planes.position.each_ref().map(|plane| of(plane).to_bits());
    let [a, b, c] = planes.log_scale.each_ref().map(|plane| fixed((of(plane) + 32.0) * 1024.0, 65535.0));
    let opacity = fixed(65535.0 / (1.0 + (-of(&planes.opacity_logit)).exp()), 65535.0);
    let (pair, last) = rotation(planes.rotation.each_ref().map(of));
    let [red, green, blue] = planes.dc.each_ref().map(|plane| half(0.5 + SH_C0 * of(plane)));
    [x, y, z, a | b << 16, c | opacity << 16, pair, last | red << 16, green | blue << 16]
}

fn pack_sh(planes: &Planes, slot: usize, words: &mut [u32]) {
    words.fill(0);
    for (number, plane) in planes.sh.iter().enumerate() {
        let value = half(plane.get(slot).copied().unwrap_or_default());
        if let Some(word) = words.get_mut(number / 2) {
            *word |= value << (16 * (number % 2));
        }
    }
}

/// A unit quaternion w, x, y, z as words 5 and 6 have it, without red.
fn rotation(quaternion: [f32; 4]) -> (u32, u32) {
    let mut largest = 0;
    for (place, part) in quaternion.iter().enumerate() {
        if part.abs() > quaternion.get(largest).map_or(0.0, |most: &f32| most.abs()) {
            largest = place;
        }
    }
    let sign = if quaternion.get(largest).is_some_and(|most| *most < 0.0) { -1.0 } else { 1.0 };
    let mut others = quaternion.iter().enumerate().filter(|(place, _)| *place != largest);
    let mut code = |most: f32| {
        let part = others.next().map_or(0.0, |(_, part)| sign * part);
        fixed((part * core::f32::consts::FRAC_1_SQRT_2 + 0.5) * most, most)
    };
    let (a, b, c) = (code(32767.0), code(32767.0), code(65535.0));
    (a | b << 15 | (largest as u32) << 30, c)
}

/// The nearest code from 0 to `most`; 0 of what is no number.
fn fixed(value: f32, most: f32) -> u32 {
    (value.clamp(0.0, most) + 0.5) as u32
}

/// The nearest binary16, in the low half; the largest one of what is beyond it.
fn half(value: f32) -> u32 {
    let bits = value.to_bits();
    let sign = bits >> 16 & 0x8000;
    let magnitude = f32::from_bits(bits & 0x7fff_ffff);
    if magnitude >= 65504.0 || magnitude.is_nan() {
        return sign | 0x7bff;
    }
    // Below 2^-14 the codes are equidistant.
    if magnitude < 6.103_515_6e-5 {
        return sign | (magnitude * 16_777_216.0 + 0.5) as u32;
    }
    sign | (magnitude.to_bits() - (112 << 23) + 0x1000) >> 13
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_are_those_of_the_standard() {
        let cases =
            [(0.0, 0), (1.0, 0x3c00), (-2.0, 0xc000), (65504.0, 0x7bff), (1e9, 0x7bff), (0.5, 0x3800)];
        for (value, code) in cases.into_iter().chain([(5.960_464_5e-8, 1), (6.103_515_6e-5, 0x400)]) {
            assert_eq!(half(value), code, "{value}");
        }
    }

    #[test]
    fn the_largest_component_of_a_rotation_is_left_out() {
        assert_eq!(rotation([1.0, 0.0, 0.0, 0.0]), (16384 | 16384 << 15, 32768));
        assert_eq!(rotation([0.0, 0.0, -1.0, 0.0]), (16384 | 16384 << 15 | 2 << 30, 32768));
        let part = core::f32::consts::FRAC_1_SQRT_2;
        assert_eq!(rotation([part, part, 0.0, 0.0]).0 & 0x7fff, 32767);
    }

    #[test]
    fn a_row_is_dirty_if_a_word_in_it_changes() {
        let everything = 0..3 * ROW;
        let all = core::slice::from_ref(&everything);
        let plane = vec![0.5; 3 * ROW];
        let mut planes = Planes { opacity_logit: plane.clone(), ..Planes::default() };
        planes.sh = vec![plane; 9];
        let mut texels = Texels::default();
        texels.write(&planes, &[], true);
        assert_eq!((&texels.base.dirty, &texels.sh.dirty), (&vec![0, 3], &vec![0, 3]));
        texels.write(&planes, all, false);
        texels.write(&planes, all, false);
        assert!(texels.base.dirty.is_empty() && texels.sh.dirty.is_empty());
        planes.opacity_logit[0] = 1.0;
        planes.opacity_logit[2 * ROW] = 1.0;
        texels.write(&planes, all, false);
        assert_eq!(texels.base.dirty, [0, 1, 2, 3]);
        assert!(texels.sh.dirty.is_empty());
    }
}
