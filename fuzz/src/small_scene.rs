//! A sequence of a few frames of a few Gaussians, made of bytes.

use arbitrary::{Arbitrary, Result, Unstructured};
use splatstream_gaussians::{GaussianFrame, MAX_SH_DEGREE, Planes, sh_coefficients};

/// More add time, not depth.
const MAX_GAUSSIANS: usize = 24;
const MAX_FRAMES: usize = 4;
/// Changes from one frame to the next.
const MAX_CHANGES: usize = 6;

/// A Gaussian: the values of a row of a PLY file.
#[derive(Debug, Clone)]
struct Row {
    position: [f32; 3],
    log_scale: [f32; 3],
    rotation: [f32; 4],
    opacity_logit: f32,
    dc: [f32; 3],
    sh: Vec<f32>,
}

/// Frames of which each is the one before with changes.
pub(crate) fn scene(u: &mut Unstructured<'_>) -> Result<Vec<GaussianFrame>> {
    let sh_degree = u.int_in_range(0..=MAX_SH_DEGREE)?;
    let mut rows =
        (0..u.int_in_range(0..=MAX_GAUSSIANS)?).map(|_| row(u, sh_degree)).collect::<Result<Vec<_>>>()?;
    let mut frames = vec![frame(&rows, sh_degree)];
    for _ in 1..u.int_in_range(1..=MAX_FRAMES)? {
        for _ in 0..u.int_in_range(0..=MAX_CHANGES)? {
            change(u, &mut rows, sh_degree)?;
        }
        frames.push(frame(&rows, sh_degree));
    }
    Ok(frames)
}

fn row(u: &mut Unstructured<'_>, sh_degree: u8) -> Result<Row> {
    let rotation = [(); 4].map(|()| i8::arbitrary(u));
    let [w, x, y, z] = rotation;
    Ok(Row {
        position: [number(u, 1.0 / 64.0)?, number(u, 1.0 / 64.0)?, number(u, 1.0 / 64.0)?],
        log_scale: [number(u, 1.0 / 2048.0)?, number(u, 1.0 / 2048.0)?, number(u, 1.0 / 2048.0)?],
        // A quaternion without a direction is no rotation.
        rotation: [f32::from(w?) + 0.5, x?.into(), y?.into(), z?.into()],
        opacity_logit: number(u, 1.0 / 2048.0)?,
        dc: [number(u, 1.0 / 8192.0)?, number(u, 1.0 / 8192.0)?, number(u, 1.0 / 8192.0)?],
        sh: (0..3 * sh_coefficients(sh_degree))
            .map(|_| Ok(f32::from(i8::arbitrary(u)?) / 128.0))
            .collect::<Result<_>>()?,
    })
}

/// A multiple of a step; now and then far out.
fn number(u: &mut Unstructured<'_>, step: f32) -> Result<f32> {
    let value = f32::from(i16::arbitrary(u)?) * step;
    Ok(if u.ratio(1, 64)? { value * 4096.0 } else { value })
}

fn change(u: &mut Unstructured<'_>, rows: &mut Vec<Row>, sh_degree: u8) -> Result<()> {
    if rows.is_empty() || u.ratio(1, 8)? {
        rows.push(row(u, sh_degree)?);
        return Ok(());
    }
    let index = u.choose_index(rows.len())?;
    match u.int_in_range(0..=3)? {
        0 => drop(rows.remove(index)),
        1 => rows[index] = row(u, sh_degree)?,
        2 => rows[index].opacity_logit = number(u, 1.0 / 2048.0)?,
        // All of them move, as a rigid body does.
        _ => {
            let by = number(u, 1.0 / 1024.0)?;
            rows.iter_mut().skip(index).for_each(|row| row.position[index % 3] += by);
        }
    }
    Ok(())
}

fn frame(rows: &[Row], sh_degree: u8) -> GaussianFrame {
    let plane = |value: &dyn Fn(&Row) -> f32| rows.iter().map(value).collect();
    let planes = Planes {
        position: [0, 1, 2].map(|axis| plane(&|row| row.position[axis])),
        log_scale: [0, 1, 2].map(|axis| plane(&|row| row.log_scale[axis])),
        rotation: [0, 1, 2, 3].map(|part| plane(&|row| row.rotation[part] / length(&row.rotation))),
        opacity_logit: plane(&|row| row.opacity_logit),
        dc: [0, 1, 2].map(|channel| plane(&|row| row.dc[channel])),
        sh: (0..3 * sh_coefficients(sh_degree)).map(|at| plane(&|row| row.sh[at])).collect(),
    };
    GaussianFrame::from_planes(sh_degree, planes).expect("planes of one length")
}

fn length(values: &[f32]) -> f32 {
    values.iter().map(|value| value * value).sum::<f32>().sqrt()
}
