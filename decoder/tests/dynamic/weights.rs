//! 6.17, 7.1 and 8.7: weights units, where they stand, and what is refused of predictor 3.

use crate::crafted::expect::{Decoded, decode_with};
use crate::crafted::{Part, sample};
use crate::random::plans;
use crate::stream::draw::codebooks;
use crate::stream::expect::{ALL, Case, assert_decodes, assert_refused, confined, fatal, point, points};
use crate::stream::network::Network;
use crate::stream::sample::{gaussian, large, small, unit};
use crate::stream::scene::{Gop, Scene};
use crate::stream::shown::Receiver;
use splatstream_decoder::operating_point::extract;
use splatstream_decoder::process::{DecodedFrame, Options};
use splatstream_format::payload::REGISTRY;
use splatstream_format::syntax::UnitType::{
    Codebook, End, FrameHeader, GopHeader as Header, Increment, Index, Weights,
};
use splatstream_format::syntax::{GopHeader, NetworkHeader, UnitId};
use splatstream_format::{ErrorKind, Limits};

/// Bytes of 5.17 and 5.17.1 before the parameters.
const FIXED: usize = 1 + 18;

type Edit = fn(&mut Scene);

/// The small scene, in which the network predicts the first two of three new Gaussians.
fn learned() -> Scene {
    let mut scene = small();
    scene.gops[0].network = Some(Network::drawn(&mut sample::Dice::new(5)));
    unit(&mut scene).predictors = vec![3, 1];
    scene
}

fn verdict_with(scene: &Scene, limits: Limits) -> Option<&'static str> {
    let options = Options { limits, ..Options::default() };
    decode_with(&scene.bytes(), &options).verdict().map(|error| error.kind.code())
}

const fn of_unit(name: &'static str, code: &'static str) -> Case {
    fatal(name, code, (Weights, 0))
}

const fn second(name: &'static str, code: &'static str) -> Case {
    fatal(name, code, (Weights, 1))
}

/// A second weights unit behind the first, with this payload.
fn twice(script: &mut crate::crafted::Script, payload: Vec<u8>) {
    script.insert_before(FrameHeader, 0, Part::unit(Weights, 0, payload));
}

// covers: SS-WT-001, SS-WT-002, SS-WT-003, SS-WT-004, SS-ER-008
#[test]
fn a_broken_weights_unit_ends_decoding() {
    assert_decodes("before any change", &learned());
    assert_refused(
        &learned(),
        &[
            of_unit("model_source", "RESERVED").script(|s| s.put(Weights, 0, 0, [2])),
            of_unit("unknown digest", "RESERVED").script(|s| *s.payload(Weights, 0) = [[1; 33]].concat()),
            of_unit("short digest", "SHORT_SECTION").script(|s| *s.payload(Weights, 0) = vec![1; 32]),
            of_unit("long digest", "TRAILING_BYTES").script(|s| *s.payload(Weights, 0) = vec![1; 34]),
            of_unit("no payload", "SHORT_SECTION").script(|s| s.payload(Weights, 0).clear()),
            of_unit("no parameters", "SHORT_SECTION").script(|s| s.payload(Weights, 0).truncate(FIXED)),
            of_unit("a parameter less", "SHORT_SECTION").script(|s| _ = s.payload(Weights, 0).pop()),
            of_unit("a byte more", "TRAILING_BYTES").script(|s| s.payload(Weights, 0).push(0)),
            of_unit("flags", "RESERVED_BITS").script(|s| s.put(Weights, 0, 1, [16])),
            of_unit("width", "OUT_OF_RANGE").script(|s| s.put(Weights, 0, 2, [7])),
            of_unit("shift of the head", "OUT_OF_RANGE").script(|s| s.put(Weights, 0, FIXED - 1, [0])),
            of_unit("no outputs", "OUT_OF_RANGE").script(|s| s.put(Weights, 0, 7, [0, 0])),
            of_unit("damage", "CHECK_SUM").script(|s| s.damage(Weights, 0)),
            // The order of 9.3: source, second unit, fixed part, parameters.
            second("twice", "CONSTRAINT").script(|s| {
                let again = s.payload(Weights, 0).clone();
                twice(s, again);
            }),
            second("a second one of a reserved source", "RESERVED").script(|s| twice(s, vec![2])),
            second("a second one that is short", "CONSTRAINT").script(|s| twice(s, vec![0, 255])),
            second("a second one that is unknown", "CONSTRAINT").script(|s| twice(s, vec![1; 33])),
            of_unit("digest that is long and unknown", "TRAILING_BYTES")
                .script(|s| *s.payload(Weights, 0) = vec![1; 40]),
            of_unit("flags and width", "RESERVED_BITS").script(|s| s.put(Weights, 0, 1, [16, 7])),
            of_unit("no outputs and a byte less", "OUT_OF_RANGE").script(|s| {
                s.put(Weights, 0, 7, [0, 0]);
                s.payload(Weights, 0).pop();
            }),
        ],
    );
}

/// A network as the registry has it.
fn registered(bytes: &[u8]) -> Network {
    let (header, parameters) = NetworkHeader::parse(bytes, 0).unwrap();
    let mut parameters = parameters.iter().copied();
    let mut byte = || parameters.next().unwrap();
    let network = Network::new(header, |_, least, _| {
        let is_wide = least < i8::MIN.into();
        if is_wide { i16::from_le_bytes([byte(), byte()]).into() } else { byte().cast_signed().into() }
    });
    assert_eq!(parameters.next(), None);
    network
}

// covers: SS-WT-001, SS-WT-004
#[test]
fn a_registered_network_is_used_as_if_the_unit_carried_it() {
    for (digest, bytes) in REGISTRY {
        let mut scene = plans().into_iter().find(|plan| plan.learned && plan.sh).unwrap().scene();
        let own = decode_with(&scene.bytes(), &Options::default()).frames;
        scene.gops[0].network = Some(registered(bytes));
        assert_decodes("carried", &scene);
        let mut script = scene.script();
        let carried = decode_with(&script.bytes(), &Options::default());
        *script.payload(Weights, 0) = [&[1], &digest[..]].concat();
        let named = decode_with(&script.bytes(), &Options::default());
        assert_eq!((named.verdict(), carried.verdict()), (None, None));
        let planes = |frames: &[DecodedFrame]| frames.iter().map(|it| it.planes.clone()).collect::<Vec<_>>();
        assert_eq!(planes(&named.frames), planes(&carried.frames));
        assert_ne!(planes(&named.frames), planes(&own));
        // With a byte of the name changed.
        script.payload(Weights, 0)[32] ^= 1;
        let error = decode_with(&script.bytes(), &Options::default()).verdict().unwrap();
        assert_eq!(error.kind.code(), "RESERVED");
    }
}

// covers: SS-BS-001, SS-BS-002, SS-UH-006
#[test]
fn weights_stand_in_phase_gop_with_the_first_frame_in_their_header() {
    let at = |place: (splatstream_format::syntax::UnitType, usize), frame: u32| {
        let mut script = large().script();
        let payload = learned().gops[0].network.as_ref().unwrap().payload();
        script.insert_before(place.0, place.1, Part::unit(Weights, frame, payload));
        decode_with(&script.bytes(), &Options::default()).verdict().map(|error| error.kind.code())
    };
    assert_eq!(at((FrameHeader, 0), 0), None);
    assert_eq!(at((Codebook, 0), 0), None);
    assert_eq!(at((FrameHeader, 5), 6), None);
    for place in
        [(Header, 0), (Increment, 0), (Increment, 1), (FrameHeader, 1), (Header, 1), (Index, 0), (End, 0)]
    {
        assert_eq!(at(place, 0), Some("UNEXPECTED_UNIT"), "{place:?}");
    }
    for (place, frame) in [((FrameHeader, 0), 1), ((FrameHeader, 5), 0), ((FrameHeader, 5), 5)] {
        assert_eq!(at(place, frame), Some("MISMATCH"), "{place:?}");
    }
    // Behind a codebook between frames.
    let mut script = large().script();
    script.insert_before(FrameHeader, 1, Part::unit(Codebook, 0, codebooks(2)[0].1.to_bytes().unwrap()));
    script.insert_before(FrameHeader, 1, Part::unit(Weights, 0, vec![2]));
    let code = |decoded: Decoded| decoded.verdict().map(|error| error.kind.code());
    assert_eq!(code(decode_with(&script.bytes(), &Options::default())), Some("UNEXPECTED_UNIT"));
    let ids: [fn(&mut UnitId); 3] =
        [|id| id.spatial_layer = 1, |id| id.temporal_layer = 1, |id| id.refinement = 1];
    for edit in ids {
        let script = learned().script();
        let at = script.at(script.find(Weights, 0)) as usize;
        let mut id = UnitId::of_frame(Weights, 0);
        edit(&mut id);
        let mut bytes = script.bytes();
        (bytes[at + 2], bytes[at + 3], bytes[at + 4]) = (id.spatial_layer, id.temporal_layer, id.refinement);
        crate::crafted::seal_header(&mut bytes[at..]);
        assert_eq!(code(decode_with(&bytes, &Options::default())), Some("OUT_OF_RANGE"), "{id:?}");
    }
}

// covers: SS-UH-005, SS-FH-003
#[test]
fn profile_0_knows_no_weights() {
    let unit = |critical: u8| {
        let mut bytes = vec![9, critical, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0];
        crate::crafted::seal_header(&mut bytes);
        Part::Bytes(bytes)
    };
    let verdict = |critical| {
        let mut script = sample::scene().script();
        script.insert_before(FrameHeader, 0, unit(critical));
        decode_with(&script.bytes(), &Options::default()).verdict().map(|error| error.kind.code())
    };
    assert_eq!((verdict(0), verdict(1)), (None, Some("RESERVED")));
}

// covers: SS-PR-002, SS-PR-003
#[test]
fn predictor_3_is_defined_by_the_network_of_the_gop() {
    let lost = |name| confined(name, "UNDEFINED", (Increment, 2));
    assert_refused(
        &learned(),
        &[
            lost("no weights").script(|s| _ = s.remove(Weights, 0)),
            confined("4", "OUT_OF_RANGE", (Increment, 2)).scene(|s| unit(s).predictors[0] = 4),
            confined("-1", "OUT_OF_RANGE", (Increment, 2)).scene(|s| unit(s).predictors[1] = -1),
            // The network of the GOP before is gone.
            confined("weights of another GOP", "UNDEFINED", (Increment, 6)).scene(|s| {
                let header = GopHeader { gop_index: 1, ..s.gops[0].header };
                s.gops.push(Gop { header, network: None, ..s.gops[0].clone() });
                s.sequence.frame_count *= 2;
            }),
            // Nothing to predict from: what is not used shall be defined all the same.
            confined("in the first unit", "UNDEFINED", (Increment, 0)).scene(|s| {
                s.gops[0].network = None;
                s.gops[0].frames[0].units[0].header.predictor_block_log2 = 0;
                s.gops[0].frames[0].units[0].predictors = vec![0, 0, 0, 3];
            }),
        ],
    );
}

// covers: SS-PR-008, SS-PR-003, SS-EC-008, SS-LM-003
#[test]
fn the_network_predicts_no_more_gaussians_than_the_limit() {
    let most = |max_learned| Limits { max_learned, ..Limits::default() };
    let scene = learned();
    assert_eq!([verdict_with(&scene, most(2)), verdict_with(&scene, most(1))], [None, Some("OVER_LIMIT")]);
    let tolerant = |limits| {
        let options = Options { limits, tolerant: true, ..Options::default() };
        decode_with(&scene.bytes(), &options)
    };
    let lossy = tolerant(most(1));
    assert_eq!((lossy.end, lossy.frames.len(), lossy.frames[1].refinements), (None, 2, 0));
    let ErrorKind::OverLimit { asked, allowed, .. } = lossy.verdict().unwrap().kind else {
        panic!("{lossy:?}")
    };
    assert_eq!((asked, allowed), (2, 1));
    // The last run is short: one Gaussian of it counts.
    let mut last = scene.clone();
    unit(&mut last).predictors = vec![0, 3];
    assert_eq!([verdict_with(&last, most(1)), verdict_with(&last, most(0))], [None, Some("OVER_LIMIT")]);
    // Without anything to predict from, and with no predictors, none is predicted.
    let mut first = learned();
    let of_intra = &mut first.gops[0].frames[0].units[0];
    (of_intra.header.predictor_block_log2, of_intra.predictors) = (16, vec![3]);
    unit(&mut first).header.predictor_block_log2 = 255;
    unit(&mut first).predictors.clear();
    assert_decodes("none is predicted", &first);
    assert_eq!(verdict_with(&first, most(0)), None);
    // 8.7: all predictors, then the limit, then positions.
    let ladder: [(&str, Edit); 4] = [
        ("CONSTRAINT", |s| unit(s).moves[0][0] = -1 << 12),
        ("OUT_OF_RANGE", |s| unit(s).predictors[1] = 4),
        ("OVER_LIMIT", |_| ()),
        ("CONSTRAINT", |s| unit(s).new[0].delta = 1 << 30),
    ];
    for (rung, (expected, _)) in ladder.iter().enumerate() {
        let mut scene = learned();
        ladder[rung..].iter().rev().for_each(|(_, edit)| edit(&mut scene));
        let limits = if rung < 3 { most(1) } else { most(2) };
        assert_eq!(verdict_with(&scene, limits), Some(*expected), "{rung}");
    }
}

// covers: SS-PL-002, SS-OP-007
#[test]
fn weights_belong_to_every_operating_point_and_count_there() {
    let mut scene = plans().into_iter().find(|plan| plan.learned && plan.layers.0 > 1).unwrap().scene();
    scene.points = Some(points(&scene));
    assert_decodes("a list", &scene);
    let bytes = scene.bytes();
    for at in points(&scene) {
        let part = extract(&bytes, at, &Limits::default()).unwrap();
        let receiver = Receiver::at(at);
        let decoded = decode_with(&part, &receiver.options());
        assert_eq!(decoded.verdict(), None, "{at:?}");
        let whole = decode_with(&bytes, &receiver.options());
        assert_eq!(decoded.shown(), whole.shown(), "{at:?}");
    }
    assert_eq!(decode_with(&bytes, &Receiver::at(ALL).options()).verdict(), None);
    assert_eq!(decode_with(&bytes, &Receiver::at(point(0, 0, 0)).options()).verdict(), None);
}

// covers: SS-PR-008, SS-LM-001
#[test]
fn the_limit_is_that_of_the_level() {
    let mut scene = learned();
    scene.level = 1;
    scene.gops[0].network = Some(crate::learned::zeros(crate::learned::PLAIN));
    let wide = unit(&mut scene);
    wide.new = vec![gaussian(0, 0); (1 << 17) + 1];
    (wide.header.predictor_block_log2, wide.header.neighbour_count) = (16, 1);
    wide.predictors = vec![3; 3];
    // The digest is wrong: a check that comes later.
    wide.edit = |header| header.refinement_digest ^= 1;
    assert_eq!(verdict_with(&scene, Limits::default()), Some("OVER_LIMIT"));
    unit(&mut scene).predictors[2] = 2;
    assert_eq!(verdict_with(&scene, Limits::default()), Some("DIGEST"));
}
