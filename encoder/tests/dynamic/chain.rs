//! 300 frames, each predicted from the one before: nothing drifts.

use crate::common::closeness::{Bounds, assert_close};
use crate::common::dynamic::{Whole, coded, predicted, scene};
use splatstream_decoder::frame::QuantizedFrame;
use splatstream_decoder::output::Companding;
use splatstream_encoder::{Settings, Tools};
use splatstream_files::builtin::Tracking;
use splatstream_format::syntax::SequenceParameters;
use splatstream_gaussians::GaussianFrame;

const FRAMES: u32 = 300;

/// Mean distance of decoded Gaussians from the nearest source, grid steps.
fn mean_error(source: &GaussianFrame, decoded: &QuantizedFrame, sequence: &SequenceParameters) -> f32 {
    let (offset, step) = (sequence.position_offset(), sequence.position_step());
    let companding = Companding::new(sequence);
    let distance = |i: usize, row: usize| {
        let error = |axis: usize| {
            (source.position()[axis][row] - offset[axis]) / step
                - companding.expand(decoded.position[axis][i]) as f32
        };
        (0..3).map(error).map(|error| error * error).sum::<f32>()
    };
    let nearest = |i: usize| (0..source.len()).map(|row| distance(i, row)).fold(f32::INFINITY, f32::min);
    (0..decoded.len()).map(nearest).map(f32::sqrt).sum::<f32>() / decoded.len() as f32
}

// covers: SS-CA-001, SS-GH-006
#[test]
fn three_hundred_predicted_frames_do_not_drift() {
    let frames = scene(100, FRAMES, 0, Tracking::Tracked);
    for layers in [1, 3] {
        let tools = Tools::default();
        let settings = Settings { gop: FRAMES, refinements: vec![20, 100], tools, ..predicted(layers) };
        let (bytes, report) = coded(&frames, &settings, "a chain");
        assert!(report.coded[1..].iter().all(|frame| frame.new + frame.removed < 20), "tracked frames go on");
        // Every digest is verified at every point.
        let whole = Whole::new(&bytes);
        assert_eq!((whole.gops.len(), whole.all().len()), (1, FRAMES as usize));
        for (frame, source) in whole.all().iter().zip(&frames) {
            let what = format!("{layers} layers, frame {}", frame.index);
            assert_close(source, &frame.planes, &whole.sequence, Bounds::PREDICTED, &what);
        }
        let error = |number: usize| mean_error(&frames[number], &whole.all()[number].planes, &whole.sequence);
        let (first, last) = ((1..11).map(error).sum::<f32>(), (290..300).map(error).sum::<f32>());
        assert!(last < 1.25 * first, "{layers} layers: error of ten frames {first} became {last}");
    }
}
