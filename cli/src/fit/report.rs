//! What `fit` says about what it has trained.

use crate::numbers::{counted, mean};
use serde::Serialize;
use splatstream_gaussians::GaussianFrame;
use std::path::PathBuf;
use std::time::Duration;

/// What `--json` prints.
#[derive(Serialize)]
pub(super) struct Fitted {
    /// The file or directory; null where nothing was written.
    output: Option<PathBuf>,
    frames: Vec<Numbered>,
    /// Means over all frames that were judged; null if none was.
    psnr_db: Option<f64>,
    held_out_psnr_db: Option<f64>,
    seconds: f64,
    #[serde(skip)]
    is_sequence: bool,
}

/// A frame and where it is.
#[derive(Serialize)]
struct Numbered {
    frame: u32,
    file: Option<PathBuf>,
    #[serde(flatten)]
    fitted: FittedFrame,
}

/// A trained frame.
#[derive(Serialize)]
pub(super) struct FittedFrame {
    gaussians: usize,
    sh_degree: u8,
    /// Steps that were taken; of a frame that an earlier run has left, 0.
    iterations: u32,
    /// Of training alone.
    seconds: f64,
    /// Means over the pictures that were trained with, and over the others; null if there are none.
    psnr_db: Option<f64>,
    held_out_psnr_db: Option<f64>,
    /// Whether an earlier run has left it.
    kept: bool,
    views: Vec<View>,
}

/// A picture beside the truth.
#[derive(Serialize)]
pub(super) struct View {
    pub(super) name: String,
    /// Whether it was kept from training.
    pub(super) held_out: bool,
    pub(super) psnr_db: f64,
}

impl FittedFrame {
    pub(super) fn of(frame: &GaussianFrame, (iterations, seconds): (u32, f64), views: Vec<View>) -> Self {
        let of = |held_out: bool| {
            mean(views.iter().filter(|view| view.held_out == held_out).map(|view| view.psnr_db))
        };
        Self {
            gaussians: frame.len(),
            sh_degree: frame.sh_degree(),
            iterations,
            seconds,
            psnr_db: of(false),
            held_out_psnr_db: of(true),
            kept: false,
            views,
        }
    }

    pub(super) fn kept(frame: &GaussianFrame) -> Self {
        Self { kept: true, ..Self::of(frame, (0, 0.0), Vec::new()) }
    }
}

impl Fitted {
    pub(super) fn new(output: Option<PathBuf>, is_sequence: bool) -> Self {
        Self { output, frames: Vec::new(), psnr_db: None, held_out_psnr_db: None, seconds: 0.0, is_sequence }
    }

    pub(super) fn add(&mut self, frame: u32, file: Option<PathBuf>, fitted: FittedFrame) {
        self.frames.push(Numbered { frame, file, fitted });
    }

    pub(super) fn is_empty(&self) -> bool {
        self.frames.is_empty()
    }

    pub(super) fn finish(&mut self, time: Duration) {
        let over = |of: fn(&FittedFrame) -> Option<f64>| {
            mean(self.frames.iter().filter_map(|frame| of(&frame.fitted)))
        };
        (self.psnr_db, self.held_out_psnr_db) =
            (over(|frame| frame.psnr_db), over(|frame| frame.held_out_psnr_db));
        self.seconds = time.as_secs_f64();
    }

    pub(super) fn text(&self) -> String {
        let name =
            self.output.as_ref().map_or("nothing written".to_owned(), |output| output.display().to_string());
        let lines = self.frames.iter().map(|frame| frame.text(self.is_sequence));
        let mean = match self.is_sequence {
            true => format!("  all frames   {}\n", decibels(self.psnr_db, self.held_out_psnr_db)),
            false => String::new(),
        };
        format!("{name}\n{}{mean}  time         {:.1} seconds\n", lines.collect::<String>(), self.seconds)
    }
}

impl Numbered {
    fn text(&self, is_sequence: bool) -> String {
        let FittedFrame {
            gaussians, sh_degree, iterations, seconds, psnr_db, held_out_psnr_db, kept, ..
        } = &self.fitted;
        let name = if is_sequence { format!("frame {:<6}", self.frame) } else { "scene       ".to_owned() };
        let gaussians = counted(*gaussians as u64, "Gaussian");
        if *kept {
            return format!("  {name} {gaussians}, as it was\n");
        }
        let each = 1000.0 * seconds / f64::from((*iterations).max(1));
        format!(
            "  {name} {gaussians} of SH degree {sh_degree}; {}; {} of {each:.0} ms\n",
            decibels(*psnr_db, *held_out_psnr_db),
            counted((*iterations).into(), "step"),
        )
    }
}

fn decibels(trained: Option<f64>, held_out: Option<f64>) -> String {
    let text = |psnr: Option<f64>| psnr.map_or("-".to_owned(), |psnr| format!("{psnr:.2} dB"));
    format!("{} in pictures it was trained with, {} in others", text(trained), text(held_out))
}
