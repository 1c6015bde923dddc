//! A row of the table of speed and size.

use crate::columns::{Column, PROGRAMS, Row, Value};
use crate::sweep::Group;
use crate::timing::Timing;

/// Where a setting stands in a comparison.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Place {
    /// None is faster that takes no more bits.
    OnFront,
    /// Another is no slower and takes no more bits.
    BeatenBy(String),
    /// It is not compared.
    Apart,
}

impl Place {
    fn value(&self) -> Value {
        match self {
            Self::OnFront => Value::words("on the front"),
            Self::BeatenBy(other) => Value::words(format!("beaten by {other}")),
            Self::Apart => Value::None,
        }
    }
}

/// A setting: what it takes at the PSNR of comparison.
#[derive(Debug, Clone)]
pub(crate) struct FrontRow {
    /// What the page calls it.
    pub(crate) name: String,
    /// What it is one of.
    pub(crate) group: Group,
    /// Whether it is of a GOP with predicted frames.
    pub(crate) is_predicted: bool,
    /// The PSNR at which sizes are compared, dB.
    pub(crate) psnr_db: f64,
    /// Bits per Gaussian of the source at that PSNR; none if its qualities do not reach there.
    pub(crate) bpg: Option<f64>,
    /// Against the baseline, percent.
    pub(crate) more_percent: Option<f64>,
    /// Gaussians coded, over all frames.
    pub(crate) gaussians: u64,
    /// Seconds to encode them, and to decode them.
    pub(crate) encode: Timing,
    pub(crate) decode: Timing,
    /// Where it stands among presets and fitting to pictures, by time to encode.
    pub(crate) encoding: Place,
    /// Where it stands among all, by time to decode.
    pub(crate) decoding: Place,
}

impl FrontRow {
    /// Gaussians encoded in a second of one processor.
    fn encode_speed(&self) -> f64 {
        self.gaussians as f64 / self.encode.work().max(f64::MIN_POSITIVE)
    }

    /// Nanoseconds of one processor to decode a Gaussian.
    pub(crate) fn decode_nanoseconds(&self) -> f64 {
        1e9 * self.decode.work() / self.gaussians.max(1) as f64
    }
}

impl Row for FrontRow {
    fn columns(rows: &[Self]) -> Vec<Column<Self>> {
        let coded = |row: &Self| Value::words(if row.is_predicted { "predicted" } else { "intra" });
        let psnr = rows.first().map_or(f64::NAN, |row| row.psnr_db);
        let bits = |row: &Self| Value::number(row.bpg, 2);
        let nanoseconds = |row: &Self| Value::number(row.decode_nanoseconds(), 1);
        vec![
            Column::new("setting", "Setting", |row: &Self| Value::words(&row.name)),
            Column::new("group", "", |row: &Self| Value::words(row.group.name())).on(PROGRAMS),
            Column::new("frames_coded", "", coded).on(PROGRAMS),
            Column::new("psnr_db", "", |row: &Self| Value::number(row.psnr_db, 2)).on(PROGRAMS),
            Column::new("bpg", "", bits).on(PROGRAMS),
            Column::of_people(format!("Bits per Gaussian at {psnr:.1} dB"), bits),
            Column::new("more_percent", "More", |row: &Self| Value::difference(row.more_percent, " %")),
            Column::new("encode_processor_s", "Encoding, s", |row: &Self| {
                Value::number(row.encode.work(), 2)
            }),
            Column::new("encode_s", "", |row: &Self| Value::number(row.encode.median, 2)).on(PROGRAMS),
            Column::new("encode_gaussians_per_processor_second", "Gaussians a second", |row: &Self| {
                Value::Speed(row.encode_speed())
            }),
            Column::new("encoding", "Encoding", |row: &Self| row.encoding.value()),
            Column::new("decode_ns_per_gaussian", "Decoding, ns per Gaussian", nanoseconds),
            Column::new("decode_s", "", |row: &Self| Value::number(row.decode.median, 6)).on(PROGRAMS),
            Column::new("decoding", "Decoding", |row: &Self| row.decoding.value()),
        ]
    }

    fn stands_out(&self) -> bool {
        self.group == Group::Baseline
    }
}
