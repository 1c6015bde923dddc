//! The pictures of a scene.

use super::elements::how_to_read;
use crate::pictures::{AMPLIFICATION, Picture, Pictures, heat};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use maud::{Markup, html};

/// Source, decoded and difference at each level.
pub(super) fn part(shown: &Pictures) -> Markup {
    html! {
        h3 { "What it looks like" }
        (how_to_read(&format!(
            "left is what is decoded, right how far each pixel is from the source, black where it is not: the largest \
             difference of a channel, times {AMPLIFICATION}; a picture leads to its full size."
        )))
        p.note { "First frame, camera " code { (shown.camera) } ", whose PSNR is in the middle of all cameras." }
        div.pictures {
            (picture(&shown.source, "the source", "source"))
            (scale())
            @for level in &shown.levels {
                @let text = format!("{} %: {:.2} dB", level.percent, level.psnr_db);
                (picture(&level.decoded, &text, &format!("decoded from {} % of the Gaussians", level.percent)))
                (picture(&level.difference, "difference", &format!("difference at {} %", level.percent)))
            }
        }
    }
}

fn picture(picture: &Picture, caption: &str, alternative: &str) -> Markup {
    let source = format!("data:image/png;base64,{}", STANDARD.encode(&picture.thumbnail));
    let (width, height) = picture.size;
    html! {
        figure {
            a href=(picture.file) { img src=(source) width=(width) height=(height) alt=(alternative); }
            figcaption { (caption) }
        }
    }
}

/// The colours of differences, and what they stand for in steps of 8 bits.
fn scale() -> Markup {
    const STEPS: u16 = 24;
    let colour = |step: u16| {
        let [red, green, blue] =
            heat(f32::from(step) / f32::from(STEPS - 1)).map(|v| (v * 255.0 + 0.5) as u8);
        format!("#{red:02x}{green:02x}{blue:02x}")
    };
    let end = 255.0 / AMPLIFICATION;
    html! {
        div.scale {
            svg viewBox="0 0 240 18" preserveAspectRatio="none" role="img" aria-label="colours of differences, from none to the end of the scale" {
                @for step in 0..STEPS { rect x=(step * 10) width="10.5" height="18" fill=(colour(step)) {} }
            }
            div.ends { span { "0" } span { (format!("{:.0}", end / 2.0)) } span { (format!("{end:.0} of 255 or more")) } }
            p.note { "colours of the differences" }
        }
    }
}
