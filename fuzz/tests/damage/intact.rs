//! What a stream without damage decodes to.

use splatstream_decoder::frame::QuantizedFrame;
use splatstream_decoder::operating_point::OperatingPoint;
use splatstream_decoder::process::{DecodedFrame, Options};
use splatstream_format::Limits;
use splatstream_fuzz::laws::{Decoded, PLAIN, exact};

/// The frames of a stream, in all refinements, of each spatial layer.
pub(crate) struct Intact(Vec<Decoded>);

impl Intact {
    pub(crate) fn new(bytes: &[u8]) -> Self {
        let at = |spatial| Decoded::of(bytes, &options(OperatingPoint { spatial, ..OperatingPoint::ALL }));
        let lowest = at(0);
        let layers = lowest.sequence.map_or(1, |sequence| sequence.spatial_layer_count);
        let all: Vec<_> = std::iter::once(lowest).chain((1..layers).map(at)).collect();
        all.iter().for_each(|decoded| assert_eq!(decoded.errors, []));
        Self(all)
    }

    /// Whether what is exact of a frame is exact: its lists are, in order, those of a spatial layer, and after some of
    /// them those of a lower one.
    pub(crate) fn has(&self, frame: &DecodedFrame) -> bool {
        let left = exact(frame);
        let left = rows(&left);
        let layers = self.0.iter().rev().filter_map(|decoded| {
            let planes = exact(decoded.frames.iter().find(|other| other.index == frame.index)?);
            Some(rows(&planes))
        });
        let mut rest = left.as_slice();
        for layer in layers {
            let start = rest.first().and_then(|first| layer.iter().position(|row| row == first));
            let of_layer = layer.get(start.unwrap_or(layer.len())..).unwrap_or_default();
            let same = rest.iter().zip(of_layer).take_while(|(one, other)| one == other).count();
            rest = &rest[same..];
        }
        rest.is_empty()
    }
}

/// All integers of each Gaussian.
fn rows(frame: &QuantizedFrame) -> Vec<Vec<i64>> {
    let row = |row: usize| {
        let position = frame.position.iter().map(|plane| i64::from(plane[row]));
        let [log_scale, rotation, dc] =
            [&frame.log_scale, &frame.rotation, &frame.dc].map(|planes| planes.iter().collect::<Vec<_>>());
        let others = [log_scale, vec![&frame.opacity], rotation, dc, frame.sh.iter().collect()].concat();
        position.chain(others.into_iter().map(|plane| i64::from(plane[row]))).collect()
    };
    (0..frame.len()).map(row).collect()
}

/// All digests are compared.
pub(crate) fn options(operating_point: OperatingPoint) -> Options {
    Options { verify: true, operating_point, limits: Limits::default(), ..PLAIN }
}
