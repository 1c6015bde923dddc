//! Clause 7.8: what is carried, shown and compensated.

use crate::write::{Plan, decoded};
use splatstream_decoder::block::{BufferPool, Workspace};
use splatstream_decoder::displacement::CellField;
use splatstream_decoder::increment::field;
use splatstream_decoder::increment::values::{PreparedSections, SectionCoding};
use splatstream_decoder::interrupt::Interrupt;
use splatstream_decoder::layout::{Section, ShCoding};
use splatstream_decoder::list::GaussianList;
use splatstream_decoder::operating_point::OperatingPoint;
use splatstream_decoder::process::{DecodedFrame, Options, Shift};
use splatstream_decoder::steps::StepRule;
use splatstream_format::Limits;
use splatstream_format::entropy::in_force::ModelsInForce;
use splatstream_format::payload::FramePayload;
use splatstream_format::syntax::UnitType;

fn at(point: &str) -> Options {
    Options { operating_point: point.parse().unwrap(), ..Options::default() }
}

/// The cells of each frame of the first GOP.
fn fields(plan: &Plan) -> Vec<CellField> {
    let (script, sequence) = (plan.script(), plan.sequence());
    let mut fields = Vec::new();
    for part in script.indices(UnitType::FrameHeader).into_iter().take(plan.gops[0] as usize) {
        let payload = &script.parts[part].payload;
        let header = FramePayload::parse(payload, 0, &sequence, &Limits::default()).unwrap();
        let Some(cells) = header.cells else {
            fields.push(CellField::default());
            continue;
        };
        let mut models = ModelsInForce::default();
        let sections = core::slice::from_ref(&cells.coded);
        let coding =
            SectionCoding { dc_rank: 0, sh: ShCoding::None, steps: StepRule::new(&sequence, [0; 5]) };
        let prepared = PreparedSections::new(sections, &coding, &mut models, &mut ()).unwrap();
        let workspace = Workspace { buffers: &BufferPool::default(), interrupt: Interrupt::NEVER };
        let values = prepared.decode(&sequence, workspace).unwrap();
        fields.push(field(values.section(Section::Cells), cells.cell_log2, &sequence, 0).unwrap());
    }
    fields
}

#[test]
fn below_the_top_layer_the_intra_frame_moves_with_the_cells() {
    let plan = Plan::predicted(1);
    let bytes = plan.script().bytes();
    let (summary, frames) = decoded(&bytes, &at("s0,t1,r9"));
    assert_eq!(summary.errors, []);
    let fields = fields(&plan);
    let anchor = GaussianList::of_planes(frames[0].planes.clone(), true);
    // Frames 1 and 2 refer to frame 0, frame 3 to frame 2. Nothing is dropped, since nothing replaces it.
    let second = anchor.clone().carried(&fields[2], false);
    for (index, expected) in [
        (1, anchor.clone().carried(&fields[1], false)),
        (3, second.clone().carried(&fields[3], false)),
        (2, second),
    ] {
        assert_eq!(frames[index].planes, expected.planes, "{index}");
        assert_eq!((frames[index].level, frames[index].carried_lists), (0, 3));
    }
    assert_ne!(frames[3].planes, frames[0].planes);
}

#[test]
fn exact_lists_come_first_and_carried_ones_fill_the_frame() {
    let plan = Plan::predicted(2);
    let bytes = plan.script().bytes();
    let whole = Plan { whole_anchor: true, ..plan.clone() }.script().bytes();
    // With a whole anchor the I frame has all lists at every refinement of the top layer.
    let (summary, frames) = decoded(&whole, &at("s1,t1,r0"));
    assert_eq!(summary.errors, []);
    let shown = |frames: &[DecodedFrame]| -> Vec<(u8, u8)> {
        frames.iter().take(4).map(|frame| (frame.level, frame.carried_lists)).collect()
    };
    assert_eq!(shown(&frames), [(3, 0), (1, 2), (1, 2), (1, 2)]);
    let subset = Options { subset: true, ..at("s1,t1,r0") };
    let (_, subsets) = decoded(&whole, &subset);
    assert_eq!(shown(&subsets), [(3, 0), (1, 0), (1, 0), (1, 0)]);
    for (frame, subset) in frames.iter().zip(&subsets) {
        assert_eq!(frame.planes.part(0..subset.planes.len()).as_ref(), Some(&subset.planes));
    }
    // A nested one has the lists of the point, and so do all frames.
    let (summary, nested) = decoded(&bytes, &at("s1,t1,r0"));
    assert_eq!((summary.errors, shown(&nested)), (Vec::new(), vec![(1, 0); 4]));
}

#[test]
fn what_is_new_is_compensated_apart_from_what_is_carried() {
    let script = Plan { whole_anchor: true, ..Plan::predicted(3) }.script();
    let header_of = |frame: u32, layer: u8, refinement: u8, temporal: u8| {
        let id =
            splatstream_format::syntax::UnitId::of_increment(frame, refinement).on_layers(layer, temporal);
        let part = &script.parts[script.find(id)];
        let sequence = Plan { whole_anchor: true, ..Plan::predicted(3) }.sequence();
        let profile = splatstream_format::syntax::Profile::Dynamic;
        let parse = splatstream_format::syntax::IncrementHeader::parse(&part.payload, 0, &sequence, profile);
        let (header, _) = parse.unwrap();
        Shift { log_scale: header.compensation_log_scale, opacity: header.compensation_opacity }
    };
    let (_, frames) = decoded(&script.bytes(), &at("s1,t1,r1"));
    assert!(frames[0].compensation.exact.is_zero(), "the I frame is complete");
    for (index, temporal) in [(1, 1), (2, 0)] {
        let compensation = &frames[index].compensation;
        assert_eq!(compensation.exact, header_of(index as u32, 1, 1, temporal));
        assert!(compensation.carried.is_zero());
        let count = frames[index].planes.len() - frames[index].carried;
        assert!(compensation.only.len() == count || compensation.exact.is_zero());
    }
    // Below the top the I frame is incomplete: what is carried is compensated as it was.
    let (_, frames) = decoded(&script.bytes(), &at("s0,t1,r1"));
    let shift = header_of(0, 0, 1, 0);
    assert_eq!((frames[0].compensation.exact, frames[0].level), (shift, 2));
    assert!(frames[1..4].iter().all(|frame| frame.compensation.carried == shift));
}

#[test]
fn a_wrong_digest_of_carried_lists_is_found_where_they_are_shown() {
    let mut script = Plan { whole_anchor: true, ..Plan::predicted(4) }.script();
    let part = script.indices(UnitType::FrameHeader)[1];
    // The digest stands after the fixed part.
    script.parts[part].payload[8] ^= 1;
    let bytes = script.bytes();
    let codes = |options: &Options| -> Vec<&'static str> {
        decoded(&bytes, options).0.errors.iter().map(|error| error.kind.code()).collect()
    };
    assert_eq!(codes(&Options::default()), [""; 0], "nothing is carried");
    assert_eq!(codes(&at("s1,t1,r1")), ["DIGEST"]);
    assert_eq!(codes(&Options { subset: true, ..at("s1,t1,r1") }), [""; 0]);
    assert_eq!(codes(&at("s0,t1,r9")), [""; 0], "the I frame is not complete");
    let (_, frames) = decoded(&bytes, &at("s1,t1,r1"));
    assert!(frames[1].error.is_some() && frames[1].carried_lists == 1);
    assert_eq!(OperatingPoint::ALL, "s255,t255,r255".parse().unwrap());
}
