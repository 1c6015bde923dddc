//! What pictures of the finished stream are worth, and the GOPs they come from.

use crate::numbers::{counted, frames};
use serde::Serialize;
use splatstream_encoder::{GopReport, Report, Settings, Size};
use splatstream_format::syntax::FrameType;

/// What was asked for.
#[derive(Clone, Copy)]
pub(super) enum Goal {
    /// Pictures of a PSNR.
    Psnr(f64),
    /// A stream of a size.
    Size(Size),
    /// Steps.
    Nothing,
}

impl Goal {
    pub(super) fn of(settings: &Settings) -> Self {
        match (settings.size, settings.psnr) {
            (Some(size), _) => Self::Size(size),
            (None, Some(decibels)) => Self::Psnr(decibels.into()),
            (None, None) => Self::Nothing,
        }
    }

    /// The PSNR that was asked for.
    pub(super) fn psnr(self) -> Option<f64> {
        match self {
            Self::Psnr(decibels) => Some(decibels),
            Self::Size(_) | Self::Nothing => None,
        }
    }
}

/// The part of the report that is about pictures and GOPs.
#[derive(Serialize)]
pub(super) struct Pictures {
    /// What was asked for, and what was measured; null where there is none.
    wanted_psnr_db: Option<f64>,
    psnr_db: Option<f64>,
    /// The same in the views that steps were fitted in.
    fitted_psnr_db: Option<f64>,
    psnr_db_by_type: ByType,
    verified: Vec<Verified>,
    /// Views of each verified frame, and their rows.
    views: u32,
    view_height: u32,
    /// How often all frames, and a part of them, were encoded for what was asked for.
    encodings: u32,
    trials: u32,
    gops: Vec<Gop>,
}

#[derive(Serialize)]
struct ByType {
    #[serde(rename = "I")]
    intra: Option<f64>,
    #[serde(rename = "P")]
    predicted: Option<f64>,
    #[serde(rename = "B")]
    enhancement: Option<f64>,
}

/// A frame of which pictures were compared.
#[derive(Serialize)]
struct Verified {
    frame: u32,
    #[serde(rename = "type")]
    frame_type: &'static str,
    psnr_db: Option<f64>,
}

/// A GOP; whether it ends before it must.
#[derive(Serialize)]
struct Gop {
    first_frame: u32,
    frames: u32,
    cut: bool,
}

impl Pictures {
    pub(super) fn of(report: &Report, settings: &Settings, goal: Goal) -> Self {
        let pictures = report.pictures.clone().unwrap_or_default();
        let verified = pictures.frames.iter().map(|frame| Verified {
            frame: frame.number,
            frame_type: frame.frame_type.name(),
            psnr_db: frame.psnr,
        });
        Self {
            wanted_psnr_db: goal.psnr(),
            psnr_db: pictures.psnr(),
            fitted_psnr_db: pictures.fitted_psnr(),
            psnr_db_by_type: ByType {
                intra: pictures.psnr_of(FrameType::Intra),
                predicted: pictures.psnr_of(FrameType::Predicted),
                enhancement: pictures.psnr_of(FrameType::Enhancement),
            },
            verified: verified.collect(),
            views: pictures.views,
            view_height: pictures.height,
            encodings: report.target.map_or(1, |target| target.encodings),
            trials: report.target.map_or(0, |target| target.trials),
            gops: report.gops.iter().map(|gop| Gop::of(gop, report, settings)).collect(),
        }
    }

    /// Lines for people.
    pub(super) fn text(&self) -> String {
        let Some(psnr) = self.psnr_db else { return self.gops_text() };
        let fitted = |fitted: f64| format!(" ({fitted:.2} dB in the views that quantisers were fitted in)");
        let wanted = self.wanted_psnr_db.map(|wanted| format!(", wanted {wanted}")).unwrap_or_default()
            + &self.fitted_psnr_db.map(fitted).unwrap_or_default();
        let mut text = format!(
            "  PSNR               {psnr:.2} dB{wanted}: decoded again, {}, {} of {} lines that \
             decide nothing\n",
            counted(self.verified.len() as u64, "frame"),
            counted(self.views.into(), "view"),
            self.view_height,
        );
        let ByType { intra, predicted, enhancement } = self.psnr_db_by_type;
        let types = [("I", intra), ("P", predicted), ("B", enhancement)];
        let types: Vec<String> =
            types.iter().filter_map(|(name, psnr)| psnr.map(|psnr| format!("{name} {psnr:.2} dB"))).collect();
        if types.len() > 1 {
            text += &format!("  PSNR by type       {}\n", types.join(", "));
        }
        text + &self.gops_text()
    }

    /// How many GOPs, how long; nothing of a single frame.
    fn gops_text(&self) -> String {
        if self.gops.iter().map(|gop| gop.frames).sum::<u32>() < 2 {
            return String::new();
        }
        let count = self.gops.len();
        let lengths = self.gops.iter().map(|gop| gop.frames);
        let (least, most) = (lengths.clone().min().unwrap_or(0), lengths.max().unwrap_or(0));
        let cut = self.gops.iter().filter(|gop| gop.cut).count();
        let mut text = match least == most {
            true => format!("  GOPs               {count} of {}", frames(most)),
            false => format!("  GOPs               {count} of {least} to {}", frames(most)),
        };
        if cut > 0 {
            text += &format!(
                "; of them end early: {cut}, because the next frame has too little in common with the one before"
            );
        }
        text + "\n"
    }
}

impl Gop {
    /// A GOP ends where a multiple of the length does, unless a frame has too little in common with the one before.
    fn of(gop: &GopReport, report: &Report, settings: &Settings) -> Self {
        let (length, end) = (settings.gop_length(), gop.first + gop.frames);
        let is_last = report.gops.last() == Some(gop);
        Self { first_frame: gop.first, frames: gop.frames, cut: end % length != 0 && !is_last }
    }
}
