//! `.ksplat` at its three levels.

use splatstream_files::ksplat;
use splatstream_gaussians::{GaussianFrame, sh_coefficients};

use super::samples::{LIMITS, small_frame};

/// A 16-bit float; the values here are not tiny.
fn half(value: f32) -> u16 {
    let bits = value.to_bits();
    let exponent = (bits >> 23 & 0xff) as i32 - 127 + 15;
    if value == 0.0 || exponent <= 0 {
        return 0;
    }
    (bits >> 16 & 0x8000) as u16 | (exponent as u16) << 10 | (bits >> 13 & 0x3ff) as u16
}

/// A frame as `.ksplat`, in buckets of a few Gaussians of which the last is not full; its blocks have a side of 8.
pub(crate) fn ksplat(frame: &GaussianFrame, level: u16, bucket: usize) -> Vec<u8> {
    let count = frame.len();
    let (full, rest) = if level == 0 { (0, 0) } else { (count / bucket, count % bucket) };
    let partial = usize::from(rest > 0);
    let buckets = full + partial;
    let mut header = vec![0; 4096];
    let mut section = vec![0; 1024];
    let put = |to: &mut Vec<u8>, at: usize, value: u32| to[at..at + 4].copy_from_slice(&value.to_le_bytes());
    header[1] = 1;
    for (at, value) in [(4, 1), (8, 1), (12, count as u32), (16, count as u32), (20, level.into())] {
        put(&mut header, at, value);
    }
    put(&mut header, 36, (-1.0_f32).to_bits());
    put(&mut header, 40, 1.0_f32.to_bits());
    let degree = u32::from(frame.sh_degree());
    for (at, value) in [(0, count as u32), (4, count as u32), (40, degree)] {
        put(&mut section, at, value);
    }
    if level > 0 {
        let fields =
            [(8, bucket as u32), (12, buckets as u32), (16, 8.0_f32.to_bits()), (20, 12), (24, 32767)];
        fields
            .into_iter()
            .chain([(32, full as u32), (36, partial as u32)])
            .for_each(|(at, value)| put(&mut section, at, value));
    }
    let mut out = [header, section].concat();
    (0..partial).for_each(|_| out.extend((rest as u32).to_le_bytes()));
    // The centre of a bucket is its first Gaussian.
    let centre = |row: usize| frame.position().each_ref().map(|plane| plane[row / bucket * bucket]);
    (0..buckets).for_each(|at| centre(at * bucket).iter().for_each(|part| out.extend(part.to_le_bytes())));
    for row in 0..count {
        let value = |out: &mut Vec<u8>, value: f32| match level {
            0 => out.extend(value.to_le_bytes()),
            _ => out.extend(half(value).to_le_bytes()),
        };
        for (plane, centre) in frame.position().iter().zip(centre(row)) {
            match level {
                0 => out.extend(plane[row].to_le_bytes()),
                _ => out.extend(
                    (((plane[row] - centre) / 4.0 * 32767.0).round() as i32 + 32767).to_le_bytes()[..2]
                        .to_vec(),
                ),
            }
        }
        frame.log_scale().iter().for_each(|plane| value(&mut out, libm::expf(plane[row])));
        frame.rotation().iter().for_each(|plane| value(&mut out, plane[row]));
        out.extend([row as u8 * 60, 128, 255, 200]);
        for degree in 1..=frame.sh_degree() {
            for channel in 0..3 {
                for coefficient in sh_coefficients(degree - 1)..sh_coefficients(degree) {
                    let sh = frame.sh()[coefficient * 3 + channel][row];
                    match level {
                        2 => out.push(((sh + 1.0) / 2.0 * 255.0).round() as u8),
                        _ => value(&mut out, sh),
                    }
                }
            }
        }
    }
    out
}

#[test]
fn all_levels_hold_the_same_within_their_steps() {
    let frame = small_frame().with_unit_rotations();
    for (level, step) in [(0, 1e-6), (1, 2e-3), (2, 2e-3)] {
        let back = ksplat::read(&ksplat(&frame, level, 2), &LIMITS).unwrap();
        assert_eq!((back.len(), back.sh_degree()), (frame.len(), frame.sh_degree()));
        let apart = |a: &[Vec<f32>], b: &[Vec<f32>]| {
            a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
        };
        assert!(apart(back.position(), frame.position()) <= step, "level {level}");
        assert!(apart(back.log_scale(), frame.log_scale()) <= step, "level {level}");
        assert!(apart(back.rotation(), frame.rotation()) <= step, "level {level}");
        assert!(
            apart(back.sh(), frame.sh()) <= if level == 2 { 1.001 / 255.0 } else { step },
            "level {level}"
        );
        assert!((back.dc()[1][0] - 0.5 / 255.0 / 0.282_094_8).abs() < 1e-6);
    }
}

#[test]
fn what_does_not_fit_is_named() {
    let good = ksplat(&small_frame(), 1, 2);
    let changed = |at: usize, value: u32| {
        let mut file = good.clone();
        file[at..at + 4].copy_from_slice(&value.to_le_bytes());
        ksplat::read(&file, &LIMITS).unwrap_err().to_string()
    };
    let said = [
        (changed(0, 0), ".ksplat of version 0.0"),
        (changed(16, 4), "the header has 4 Gaussians, the sections have 3"),
        (changed(20, 3), "compression level 3, 0 to 2 are known"),
        (changed(4096, 9), "a section has 9 Gaussians in room for 3"),
        (changed(4096 + 40, 4), "a section of SH degree 4"),
        (changed(4096 + 32, 9), "9 full buckets and 1 others, of 2"),
        (changed(4096 + 1024, 0), "Gaussian 2 lies in no bucket"),
        (changed(4, u32::MAX), "the headers of sections needs"),
    ];
    for (said, expected) in said {
        assert!(said.contains(expected), "{expected} is not in: {said}");
    }
}
