//! Source, decoded, difference: one camera, each refinement level.

use super::measure::{Point, Run};
use super::picture_comparison::{BACKGROUND, Judge};
use crate::Error;
use crate::first_frame::first_frame;
use crate::report::File;
use splatstream_decoder::process::Options;
use splatstream_files::srgb;
use splatstream_render::{Image, render};

/// What differences are multiplied with: an eighth of the range is the end of the scale.
pub(crate) const AMPLIFICATION: f32 = 8.0;
/// Pixels in a row of the pictures inside the page, about.
const THUMBNAIL: usize = 400;

/// A picture in the page and beside it.
pub(crate) struct Picture {
    /// Small, as PNG.
    pub(crate) thumbnail: Vec<u8>,
    /// Pixels of the small one.
    pub(crate) size: (usize, usize),
    /// Where the full-size PNG is, from the page.
    pub(crate) file: String,
}

/// What a refinement level looks like.
pub(crate) struct LevelPictures {
    /// Share of the Gaussians, percent.
    pub(crate) percent: u8,
    /// PSNR of this picture, dB.
    pub(crate) psnr_db: f64,
    /// As decoded.
    pub(crate) decoded: Picture,
    /// How far from the source.
    pub(crate) difference: Picture,
}

/// The pictures of a scene: its first frame from one camera.
pub(crate) struct Pictures {
    /// Name of the camera.
    pub(crate) camera: String,
    /// The source.
    pub(crate) source: Picture,
    /// By level, all Gaussians last.
    pub(crate) levels: Vec<LevelPictures>,
}

/// Draws and shrinks the pictures of a run, and adds them to `files`.
pub(crate) fn pictures(
    scene: &str,
    run: &Run,
    judge: &Judge<'_>,
    files: &mut Vec<File>,
) -> Result<Option<Pictures>, Error> {
    let Some(place) = run.full().and_then(typical_camera) else { return Ok(None) };
    let (Some(camera), Some(reference)) = (judge.cameras().get(place), judge.reference(0, place)) else {
        return Ok(None);
    };
    let mut keep = |image: &Image, name: &str| kept(image, format!("pictures/{scene}/{name}"), files);
    let source = keep(&reference.colour, "source.png")?;
    let mut levels = Vec::new();
    for point in &run.points {
        let Some(frame) = first_frame(&run.stream, point.info.point, &Options::default())? else { continue };
        let image = render(&frame, camera, BACKGROUND).colour;
        let percent = point.info.percent;
        let view = point.frames.first().and_then(|frame| frame.views.get(place));
        levels.push(LevelPictures {
            percent,
            psnr_db: view.map_or(f64::NAN, |view| view.psnr_db),
            decoded: keep(&image, &format!("decoded-{percent}.png"))?,
            difference: keep(&difference(&reference.colour, &image), &format!("difference-{percent}.png"))?,
        });
    }
    Ok(Some(Pictures { camera: camera.name.clone(), source, levels }))
}

/// The camera with the PSNR in the middle: neither the best nor the worst that can be shown.
fn typical_camera(point: &Point) -> Option<usize> {
    let views = &point.frames.first()?.views;
    let mut places: Vec<usize> = (0..views.len()).collect();
    places.sort_by(|&a, &b| views[a].psnr_db.total_cmp(&views[b].psnr_db));
    places.get(places.len() / 2).copied()
}

/// The largest difference of a channel, amplified, in colours.
fn difference(reference: &Image, image: &Image) -> Image {
    let pixel = |(a, b): (&[f32; 3], &[f32; 3])| {
        let channel = |c: usize| (a[c].clamp(0.0, 1.0) - b[c].clamp(0.0, 1.0)).abs();
        heat(AMPLIFICATION * channel(0).max(channel(1)).max(channel(2)))
    };
    Image::new(reference.width(), reference.pixels().iter().zip(image.pixels()).map(pixel).collect())
}

/// A colour for 0 (black) to 1 (nearly white): lightness rises evenly to the eye, hue turns from violet to
/// yellow. In OKLab; source of its matrices: B. Ottosson, "A perceptual color space for image processing", 2020.
pub(crate) fn heat(value: f32) -> [f32; 3] {
    let value = if value.is_finite() { value.clamp(0.0, 1.0) } else { 1.0 };
    let lightness = 0.97 * value;
    let chroma = 0.6 * value * (1.0 - value) + 0.04 * value;
    let hue = (-70.0 + 170.0 * value).to_radians();
    let (a, b) = (chroma * libm::cosf(hue), chroma * libm::sinf(hue));
    let l = lightness + 0.396_337_78 * a + 0.215_803_76 * b;
    let m = lightness - 0.105_561_346 * a - 0.063_854_17 * b;
    let s = lightness - 0.089_484_18 * a - 1.291_485_5 * b;
    let [l, m, s] = [l, m, s].map(|cone| cone * cone * cone);
    [
        4.076_741_7 * l - 3.307_711_6 * m + 0.230_969_94 * s,
        -1.268_438 * l + 2.609_757_4 * m - 0.341_319_38 * s,
        -0.004_196_086_3 * l - 0.703_418_6 * m + 1.707_614_7 * s,
    ]
    .map(|linear| srgb::encode(linear.clamp(0.0, 1.0).into()) as f32)
}

/// Keeps a picture and makes a small one of it.
fn kept(image: &Image, name: String, files: &mut Vec<File>) -> Result<Picture, Error> {
    let failed = |error| Error::other(format!("{name}: cannot be drawn: {error}"));
    let small = shrunk(image, image.width().div_ceil(THUMBNAIL));
    let picture = Picture {
        thumbnail: small.to_png().map_err(failed)?,
        size: (small.width(), small.height()),
        file: name.clone(),
    };
    files.push(File { bytes: image.to_png().map_err(failed)?, name });
    Ok(picture)
}

/// The means of squares of `side` pixels; what does not fill a square is left out.
fn shrunk(image: &Image, side: usize) -> Image {
    let (width, height) = (image.width() / side, image.height() / side);
    if side < 2 || width == 0 || height == 0 {
        return image.clone();
    }
    let weight = 1.0 / (side * side) as f32;
    let mean = |(x, y): (usize, usize)| {
        let mut sum = [0.0_f32; 3];
        for row in y * side..(y + 1) * side {
            let start = row * image.width() + x * side;
            for pixel in &image.pixels()[start..start + side] {
                sum.iter_mut().zip(pixel).for_each(|(sum, value)| *sum += value.clamp(0.0, 1.0) * weight);
            }
        }
        sum
    };
    let places = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    Image::new(width, places.map(mean).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_error_is_brighter() {
        let luma = |[r, g, b]: [f32; 3]| 0.2126 * r + 0.7152 * g + 0.0722 * b;
        let lumas: Vec<f32> = (0..=20).map(|step| luma(heat(step as f32 / 20.0))).collect();
        assert!(lumas.windows(2).all(|pair| pair[0] < pair[1]), "{lumas:?}");
        assert_eq!(heat(0.0), [0.0; 3]);
        assert!(lumas[20] > 0.9);
    }

    #[test]
    fn a_shrunk_picture_has_the_means() {
        let image = Image::new(3, vec![[0.0; 3], [1.0; 3], [9.0; 3], [1.0; 3], [0.0; 3], [9.0; 3]]);
        let small = shrunk(&image, 2);
        assert_eq!((small.width(), small.pixels()), (1, &[[0.5; 3]][..]));
    }
}
