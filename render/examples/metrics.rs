//! Figures of the metrics as JSON, for `render/checks/metrics.py`:
//!
//! ```text
//! metrics pictures REFERENCE.png IMAGE.png [--mask MASK.png] [--weights WEIGHTS.npz]
//! metrics curves CURVES.json
//! metrics speed WIDTH HEIGHT WEIGHTS.npz
//! ```
//!
//! A mask counts where its red is above 0. Curves are `{"anchor": [[rate, quality], ...], "test": ...}`. Times
//! are in milliseconds, for pictures of noise.

use serde::Deserialize;
use serde_json::{Value, json};
use splatstream_render::Image;
use splatstream_render::metrics::{RatePoint, StLpips, bd_psnr, bd_rate, compare, psnr, ssim};
use std::error::Error;
use std::io::{Write, stdout};
use std::path::Path;
use std::time::Instant;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let figures = match arguments[..] {
        ["pictures", reference, image, ref options @ ..] => pictures(reference, image, options)?,
        ["curves", curves] => mean_differences(curves)?,
        ["speed", width, height, weights] => speed(width.parse()?, height.parse()?, weights)?,
        _ => return Err("what to compare? See the head of the example's source".into()),
    };
    Ok(writeln!(stdout(), "{figures}")?)
}

fn read(path: &str) -> Result<Image, Box<dyn Error>> {
    Ok(Image::from_png(&std::fs::read(path)?)?)
}

fn pictures(reference: &str, image: &str, options: &[&str]) -> Result<Value, Box<dyn Error>> {
    let option = |name| options.chunks(2).find(|option| option[0] == name).and_then(|option| option.get(1));
    let (reference, image) = (read(reference)?, read(image)?);
    let alpha: Vec<f32> = match option("--mask") {
        Some(mask) => read(mask)?.pixels().iter().map(|pixel| pixel[0]).collect(),
        None => vec![1.0; reference.pixels().len()],
    };
    let learned = option("--weights").map(|path| StLpips::read(Path::new(path))).transpose()?;
    Ok(serde_json::to_value(compare(&reference, &alpha, &image, learned.as_ref()))?)
}

#[derive(Deserialize)]
struct Curves {
    anchor: Vec<(f64, f64)>,
    test: Vec<(f64, f64)>,
}

fn mean_differences(path: &str) -> Result<Value, Box<dyn Error>> {
    let curves: Curves = serde_json::from_slice(&std::fs::read(path)?)?;
    let points = |curve: &[(f64, f64)]| -> Vec<RatePoint> {
        curve.iter().map(|&(rate, quality)| RatePoint { rate, quality }).collect()
    };
    let (anchor, test) = (points(&curves.anchor), points(&curves.test));
    Ok(json!({ "bd_rate": bd_rate(&anchor, &test), "bd_psnr": bd_psnr(&anchor, &test) }))
}

fn speed(width: usize, height: usize, weights: &str) -> Result<Value, Box<dyn Error>> {
    let noise = |seed: usize| {
        let value = |i: usize| ((i ^ seed).wrapping_mul(2_654_435_761) >> 8 & 0xffff) as f32 / 65_535.0;
        Image::new(width, (0..width * height).map(|i| [3 * i, 3 * i + 1, 3 * i + 2].map(value)).collect())
    };
    let (reference, image) = (noise(0), noise(0x5555));
    let learned = StLpips::read(Path::new(weights))?;
    let time = |metric: &dyn Fn() -> Option<f64>| {
        let start = Instant::now();
        let figure = metric();
        json!({ "figure": figure, "milliseconds": start.elapsed().as_secs_f64() * 1e3 })
    };
    let features = learned.features(&reference).ok_or("a picture too small")?;
    Ok(json!({
        "psnr": time(&|| Some(psnr(&reference, &image))),
        "ssim": time(&|| ssim(&reference, &image)),
        "st_lpips": time(&|| learned.distance(&reference, &image)),
        "st_lpips_known_reference":
            time(&|| Some(learned.feature_distance(&features, &learned.features(&image)?))),
    }))
}
