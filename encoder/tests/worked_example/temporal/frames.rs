//! What frames carry and show: clauses 7.18 and 7.10.

use super::walk::{Step, Walked};
use super::{Names, gaussians, list, name_list, of};
use splatstream_decoder::operating_point::{OperatingPoint, extract};
use splatstream_decoder::output::to_gaussians;
use splatstream_decoder::process::{DecodedFrame, Options};
use splatstream_decoder::stream::decode_stream;
use splatstream_format::Limits;
use splatstream_format::syntax::SequenceParameters;
use std::fmt::Write as _;
use std::ops::ControlFlow;

/// All units of frame 0, and of the others those of refinement 0.
const REFINEMENT_0: OperatingPoint = OperatingPoint { spatial: 1, temporal: 1, refinement: 0 };

/// The frames at an operating point.
fn decoded(bytes: &[u8], operating_point: OperatingPoint) -> (SequenceParameters, Vec<DecodedFrame>) {
    let (mut known, mut frames) = (None, Vec::new());
    let options = Options { operating_point, ..Options::default() };
    let summary = decode_stream(bytes, &options, |sequence, frame| {
        known = Some(*sequence);
        frames.push(frame);
        ControlFlow::Continue(())
    });
    assert_eq!(summary.end, None);
    (known.unwrap(), frames)
}

/// Clause 7.18.1.
pub(crate) fn carried(text: &mut String, frames: &[Walked], names: &Names) {
    text.push_str(
        "\n## E.10 Carried lists\n\nFrame 0 carries its homes of the highest spatial layer. In the other frames, what \
         lies in a stale cell is left out and the rest is displaced (7.18.1).\n",
    );
    for frame in &frames[1..] {
        let reference = &frames[frame.reference.unwrap() as usize];
        for (home, list) in frame.carried.iter().enumerate() {
            let before = &reference.carried[home];
            let stays = |&i: &usize| {
                let cell = frame.field.find(of(&before.position_fine, i));
                !cell.is_some_and(|cell| cell.stale)
            };
            let all = name_list(names, (reference.number, 1, home as u8));
            let left: Vec<String> = (0..before.len()).filter(stays).map(|i| all[i].clone()).collect();
            let gone: Vec<String> = all.iter().filter(|name| !left.contains(name)).cloned().collect();
            write!(text, "\n`carried({}, {home})`", frame.number).unwrap();
            let without =
                if gone.is_empty() { String::new() } else { format!(", without {}", gone.join(", ")) };
            writeln!(text, "{without}:").unwrap();
            gaussians(text, list, &left);
        }
    }
}

/// Clauses 7.18.2 and 7.18.3.
pub(crate) fn shown(text: &mut String, bytes: &[u8]) {
    let (_, frames) = decoded(bytes, REFINEMENT_0);
    let small = extract(bytes, REFINEMENT_0, &Limits::default()).unwrap();
    assert_eq!(decoded(&small, REFINEMENT_0).1.len(), frames.len());
    write!(
        text,
        "\n## E.11 The shown frames at refinement 0\n\nWhat is shown at {REFINEMENT_0}; extracted there, the stream has \
         {} of {} bytes. Frame 0 is complete (SS-OP-006). The others show their home 0, which is exact, and then \
         what they carry of home 1 (7.18.2); q and o are output with the compensation of 7.18.3.\n\n\
         | Frame | i | Source | position | q | o | Compensated | q for output | o for output |\n\
         |---|---|---|---|---|---|---|---|---|\n",
        small.len(),
        bytes.len()
    )
    .unwrap();
    for frame in frames {
        let planes = frame.planes.clone();
        let exact = planes.len() - frame.carried;
        let (number, applies) = (frame.number, frame.compensation.applies.clone());
        let output = frame.into_shown();
        for i in 0..planes.len() {
            let applied = applies.get(i).copied().unwrap_or(false);
            writeln!(
                text,
                "| {number} | {i} | {} | {} | {} | {} | {} | {} | {} |",
                if i < exact { "exact" } else { "carried" },
                list(of(&planes.position, i)),
                list(of(&planes.log_scale, i)),
                planes.opacity[i],
                if applied { "yes" } else { "no" },
                list(of(&output.log_scale, i)),
                output.opacity[i]
            )
            .unwrap();
        }
    }
}

/// Clause 7.18.4.
pub(crate) fn digests(text: &mut String, frames: &[Walked]) {
    text.push_str(
        "\n## E.12 Digests\n\nBoth digests of each unit, as the decoder computes them, and the lists they are of \
         (7.18.4); they are those of the elements.\n\n| Unit | Lists | refinement_digest | Carried lists | \
         carried_digest |\n|---|---|---|---|---|\n",
    );
    for frame in frames {
        for Step { id, digests: [exact, carried], .. } in &frame.steps {
            let (s, r, t) = (id.spatial_layer, id.refinement, frame.number);
            let homes = list((0..=r).map(|h| format!("home({s}, {h})")));
            let lists: Vec<String> = match frame.reference {
                Some(_) => {
                    (usize::from(r) + 1..frame.carried.len()).map(|h| format!("carried({t}, {h})")).collect()
                }
                None => Vec::new(),
            };
            let lists = if lists.is_empty() { "none".to_owned() } else { list(lists) };
            writeln!(
                text,
                "| ({s}, {r}) of frame {t} | {homes} | `{exact:#018x}` | {lists} | `{carried:#018x}` |"
            )
            .unwrap();
        }
    }
}

/// Clause 7.10 for the last exact Gaussian of frame 1 at refinement 0, which is compensated.
pub(crate) fn output(text: &mut String, bytes: &[u8]) {
    let (sequence, mut frames) = decoded(bytes, REFINEMENT_0);
    let frame = frames.swap_remove(1);
    let i = frame.planes.len() - frame.carried - 1;
    let planes = frame.into_shown();
    let signed: Vec<i32> = planes.signed_planes().map(|plane| plane[i]).collect();
    let position = of(&planes.position, i);
    let gaussians = to_gaussians(planes, &sequence);
    write!(
        text,
        "\n## E.13 The output of one Gaussian\n\nGaussian {i} of frame 1 as it is shown at refinement 0, after its \
         compensation, by 7.10.\n\n| Output | Integer | Value |\n|---|---|---|\n"
    )
    .unwrap();
    let mut row = |name: &str, integer: String, value: f32| {
        writeln!(text, "| {name} | {integer} | {value} (`{:08x}`) |", value.to_bits()).unwrap();
    };
    for (axis, (integer, plane)) in position.iter().zip(gaussians.position()).enumerate() {
        row(&format!("position [{axis}]"), integer.to_string(), plane[i]);
    }
    for (k, (integer, plane)) in signed.iter().zip(gaussians.log_scale()).enumerate() {
        row(&format!("log_scale [{k}]"), integer.to_string(), plane[i]);
    }
    row("opacity", signed[3].to_string(), gaussians.opacity_logit()[i]);
    for (k, name) in ["w", "x", "y", "z"].into_iter().enumerate() {
        let integer = k.checked_sub(1).map_or_else(|| "none".to_owned(), |k| signed[4 + k].to_string());
        row(&format!("rotation {name}"), integer, gaussians.rotation()[k][i]);
    }
    for (k, name) in ["red", "green", "blue"].into_iter().enumerate() {
        row(&format!("dc {name}"), signed[7 + k].to_string(), gaussians.dc()[k][i]);
    }
}
