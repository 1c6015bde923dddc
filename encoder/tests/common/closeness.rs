//! How far decoded Gaussians are from their sources, in quantiser steps.

use splatstream_decoder::frame::QuantizedFrame;
use splatstream_decoder::output::Companding;
use splatstream_format::syntax::SequenceParameters;
use splatstream_gaussians::GaussianFrame;

/// The largest errors, steps.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Bounds {
    /// Of a log-scale or an opacity.
    pub(crate) value: f32,
    /// Of a component of a colour transform.
    pub(crate) colour: f32,
    /// Of a position or a part of a rotation. Predicted ones lie between the points of their grid and are rounded
    /// once more where they are shown.
    pub(crate) place: f32,
    /// Whether SH is compared; codebooks have no bound.
    pub(crate) sh: bool,
}

impl Bounds {
    /// Of an intra frame: half a step.
    pub(crate) const INTRA: Self = Self { value: 0.5, colour: 0.5, place: 0.5, sh: true };
    /// Of a predicted frame: the encoder leaves up to one and a half steps where a change would take many bits.
    pub(crate) const PREDICTED: Self = Self { value: 1.5, colour: 1.5, place: 2.0, sh: true };
}

/// Steps that are asked for are so many of the finest.
const NOMINAL: f32 = 8.0;

/// What f32 rounds on the way, steps.
const SLACK: f32 = 0.03;

/// One Gaussian in steps.
struct Row {
    position: [f32; 3],
    log_scale: [f32; 3],
    /// A quaternion of length 1, w first, not in steps.
    rotation: [f32; 4],
    opacity: f32,
    colour: Vec<f32>,
    sh: Vec<f32>,
}

fn source_row(frame: &GaussianFrame, row: usize, sequence: &SequenceParameters) -> Row {
    let offset = sequence.position_offset();
    let turn = [0, 1, 2, 3].map(|part: usize| frame.rotation()[part][row]);
    let norm = turn.iter().map(|part| part * part).sum::<f32>().sqrt();
    let sh = |plane: usize| frame.sh().get(plane).map_or(0.0, |values| values[row] / sequence.sh_step());
    Row {
        position: [0, 1, 2]
            .map(|axis: usize| (frame.position()[axis][row] - offset[axis]) / sequence.position_step()),
        log_scale: [0, 1, 2].map(|axis: usize| {
            (frame.log_scale()[axis][row] - sequence.log_scale_offset()) / sequence.log_scale_step()
        }),
        rotation: turn.map(|part| part / norm),
        opacity: (frame.opacity_logit()[row] - sequence.opacity_offset()) / sequence.opacity_step(),
        colour: (0..3).map(|plane: usize| frame.dc()[plane][row] / sequence.dc_step()).collect(),
        sh: (0..usize::from(sequence.sh_dimension())).map(sh).collect(),
    }
}

/// Hamilton product, w first.
fn product(a: [f32; 4], b: [f32; 4]) -> [f32; 4] {
    [
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    ]
}

/// Every way to name the axes of a Gaussian: orders, and the turns that go with them.
pub(crate) fn namings() -> Vec<([usize; 3], [f32; 4])> {
    let (half, root) = (0.5_f32, 0.5_f32.sqrt());
    let orders = [
        ([0, 1, 2], [1.0, 0.0, 0.0, 0.0]),
        ([1, 2, 0], [half, half, half, half]),
        ([2, 0, 1], [half, -half, -half, -half]),
        ([0, 2, 1], [root, root, 0.0, 0.0]),
        ([1, 0, 2], [root, 0.0, 0.0, root]),
        ([2, 1, 0], [root, 0.0, root, 0.0]),
    ];
    let halves = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]];
    let with = |(order, turn)| halves.map(|half_turn| (order, product(turn, half_turn)));
    orders.into_iter().flat_map(with).collect()
}

/// The same Gaussian with its axes named otherwise.
pub(crate) fn renamed(
    log_scale: [f32; 3],
    rotation: [f32; 4],
    (order, turn): ([usize; 3], [f32; 4]),
) -> ([f32; 3], [f32; 4]) {
    (order.map(|axis| log_scale[axis]), product(rotation, turn))
}

fn within(a: f32, b: f32, bound: f32) -> bool {
    (a - b).abs() <= bound + SLACK
}

/// Whether scale and rotation are near in one of the ways to write them.
fn is_near_in_shape(source: &Row, log_scale: [f32; 3], turn: [f32; 3], step: f32, bounds: Bounds) -> bool {
    let round = log_scale[0] == log_scale[1] && log_scale[1] == log_scale[2];
    namings().into_iter().any(|naming| {
        let (scales, rotation) = renamed(source.log_scale, source.rotation, naming);
        let sign = if rotation[0] < 0.0 { -1.0 } else { 1.0 };
        (0..3).all(|k| within(scales[k], log_scale[k], bounds.value))
            && (round
                || (0..3).all(|k| within(sign * rotation[k + 1] / step, turn[k], NOMINAL * bounds.place)))
    })
}

/// The largest length of an error of which each component of an orthonormal basis is at most `bound`.
fn is_near_in_colour(source: &[f32], planes: &[Vec<i32>], row: usize, bound: f32) -> bool {
    let error = |(value, plane): (&f32, &Vec<i32>)| value - plane[row] as f32 / 64.0;
    let length = source.iter().zip(planes).map(error).map(|error| error * error).sum::<f32>().sqrt();
    // Bases are rounded, and so is every value, to a 64th of a step.
    length <= 1.02 * (bound + SLACK) * (source.len() as f32).sqrt()
}

/// Each decoded Gaussian has a source within the bounds, and none is used twice.
pub(crate) fn assert_close(
    source: &GaussianFrame,
    decoded: &QuantizedFrame,
    sequence: &SequenceParameters,
    bounds: Bounds,
    what: &str,
) {
    let rows: Vec<Row> = (0..source.len()).map(|row| source_row(source, row, sequence)).collect();
    let mut used = vec![false; rows.len()];
    let companding = Companding::new(sequence);
    let bounds = Bounds { value: NOMINAL * bounds.value, colour: NOMINAL * bounds.colour, ..bounds };
    for i in 0..decoded.len() {
        let log_scale = decoded.log_scale.each_ref().map(|plane| plane[i] as f32);
        let turn = decoded.rotation.each_ref().map(|plane| plane[i] as f32);
        let is_source = |row: &Row| {
            (0..3).all(|axis: usize| {
                let rounding = row.position[axis].abs() * 4.0 * f32::EPSILON;
                let code = decoded.position[axis][i];
                let point = companding.expand(code) as f32;
                // Outside the linear part of the grid steps are larger.
                let step = (companding.expand(code + 1) as f32 - point)
                    .max(point - companding.expand(code.max(1) - 1) as f32);
                within(row.position[axis], point, bounds.place * step + rounding)
            }) && within(row.opacity, decoded.opacity[i] as f32, bounds.value)
                && is_near_in_colour(&row.colour, &decoded.dc, i, bounds.colour)
                && (!bounds.sh || is_near_in_colour(&row.sh, &decoded.sh, i, bounds.colour))
                && is_near_in_shape(row, log_scale, turn, sequence.rotation_step(), bounds)
        };
        let found = (0..rows.len()).find(|&row| !used[row] && is_source(&rows[row]));
        used[found.unwrap_or_else(|| panic!("{what}: Gaussian {i} is near no source"))] = true;
    }
}
