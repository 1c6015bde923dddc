//! Clauses 7.2 and 7.11: operating points, what they cost, and extraction.

use crate::write::{Part, Plan, decoded};
use splatstream_decoder::operating_point::{OperatingPoint, all_points, extract, operating_points};
use splatstream_decoder::process::Options;
use splatstream_format::Limits;
use splatstream_format::syntax::{UnitId, UnitType};

fn plans() -> [Plan; 3] {
    [Plan::intra(1), Plan::predicted(2), Plan { whole_anchor: true, ..Plan::predicted(3) }]
}

#[test]
fn a_part_of_a_stream_decodes_as_the_stream_does_at_its_point() {
    for plan in plans() {
        let bytes = plan.script().bytes();
        assert_eq!(extract(&bytes, OperatingPoint::ALL, &Limits::default()).unwrap(), bytes);
        for point in all_points(&plan.sequence()) {
            let options = Options { operating_point: point, ..Options::default() };
            let (summary, frames) = decoded(&bytes, &options);
            assert_eq!(summary.errors, [], "{point}");
            let part = extract(&bytes, point, &Limits::default()).unwrap();
            assert_eq!(decoded(&part, &Options::default()), (summary.clone(), frames.clone()), "{point}");
            assert_eq!(extract(&part, point, &Limits::default()).unwrap(), part);
        }
    }
}

#[test]
fn frames_of_one_layer_are_nested() {
    let plan = Plan { percents: vec![3, 20, 40, 100], ..Plan::intra(4) };
    let bytes = plan.script().bytes();
    let (_, whole) = decoded(&bytes, &Options::default());
    for refinement in 0..4 {
        let operating_point = OperatingPoint { refinement, ..OperatingPoint::ALL };
        let (_, frames) = decoded(&bytes, &Options { operating_point, ..Options::default() });
        for (frame, whole) in frames.iter().zip(&whole) {
            let count = plan.sequence().prefix_length(refinement, 200) as usize;
            assert_eq!(
                (frame.planes.len(), Some(&frame.planes)),
                (count, whole.planes.part(0..count).as_ref())
            );
        }
    }
}

#[test]
fn what_a_point_costs_follows_from_headers_alone() {
    for plan in plans() {
        let bytes = plan.script().bytes();
        for info in operating_points(&bytes, &Limits::default()).unwrap() {
            let options = Options { operating_point: info.point, ..Options::default() };
            let (_, frames) = decoded(&bytes, &options);
            let exact: usize = frames.iter().map(|frame| frame.planes.len() - frame.carried).sum();
            assert_eq!(
                (info.gaussians, info.frames as usize),
                (exact as u64, frames.len()),
                "{}",
                info.point
            );
            // All but the file header, copies of sequence parameters, index and end.
            let part = extract(&bytes, info.point, &Limits::default()).unwrap().len() as u64;
            let entries = 16 * plan.gops.len() as u64;
            let others = 16 + plan.gops.len() as u64 * 126 + (24 + entries) + 36;
            assert_eq!(info.bytes, part - others, "{}", info.point);
        }
    }
}

#[test]
fn a_list_of_points_is_compared_if_the_whole_stream_was_decoded() {
    let plan = Plan::predicted(5);
    let mut script = plan.script();
    let mut tally = splatstream_decoder::operating_point::Tally::new(plan.profile);
    let units = script.bytes();
    let stream = splatstream_format::unit::Stream::open(&units, &Limits::default()).unwrap();
    stream.units().for_each(|unit| tally.unit(&unit.unwrap()));
    let list = tally.list().to_bytes().unwrap();
    script.parts.push(Part::new(UnitId::stream(UnitType::OperatingPoints), list));
    assert_eq!(decoded(&script.bytes(), &Options::default()).0.errors, []);
    let last = script.parts.len() - 1;
    *script.parts[last].payload.last_mut().unwrap() ^= 1;
    let verdict =
        |options: &Options| decoded(&script.bytes(), options).0.verdict().map(|error| error.kind.code());
    assert_eq!(verdict(&Options::default()), Some("MISMATCH"));
    let operating_point = OperatingPoint { refinement: 1, ..OperatingPoint::ALL };
    assert_eq!(verdict(&Options { operating_point, ..Options::default() }), None);
}
