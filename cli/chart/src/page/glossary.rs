//! Terms in words.

use maud::{Markup, html};

const TERMS: [(&str, &str); 19] = [
    ("Gaussian", "a soft coloured ellipsoid; some hundred thousand of them make a scene."),
    (
        "bits per Gaussian",
        "size in bits over a number of Gaussians. Of the source: all that the source has in these frames, the same for every variant and codec, so it compares sizes. Shown: those at that refinement level. Coded: those in the stream.",
    ),
    (
        "Mbit/s",
        "what a network must carry to play at the frame rate: 8 × bytes per frame × frames per second, in millions. Not of a scene that stands still.",
    ),
    (
        "PSNR",
        "peak signal to noise ratio over red, green and blue, in dB: 30 is visibly different, 40 hard to tell apart; 3 dB more is half the squared error. At most 100 here.",
    ),
    ("SSIM", "structural similarity of the pictures: 1 is equal."),
    (
        "ST-LPIPS",
        "a distance learned from what people see (shift tolerant, AlexNet): 0 is equal. Not the same scale as LPIPS.",
    ),
    ("quality", "how finely attributes are quantised: low, medium, high, visually-lossless."),
    (
        "refinement level",
        "a share of each frame's Gaussians, the most important first. A receiver may stop at any level.",
    ),
    (
        "operating point",
        "the layers that a receiver takes: spatial, temporal, refinement; s0,t0,r2 is the third refinement level.",
    ),
    (
        "unit",
        "a piece of the stream that can be sent or left out by itself. I0 is the intra-coded first frame, r0 its first refinement.",
    ),
    ("GOP", "group of pictures: frames that share tables; decoding can start at each."),
    ("preset", "how much the encoder does: fast, balanced, small."),
    ("baseline", "the variant that all others are compared with."),
    ("without …", "the baseline with one tool left out: what the tool is worth."),
    (
        "at the baseline's rate",
        "PSNR of a variant, interpolated between its qualities, where it is as large as the baseline (PCHIP over the logarithm of the rate).",
    ),
    (
        "BD-rate",
        "Bjøntegaard: the mean difference in size at equal PSNR over all qualities, per cent; −5 % is 5 % smaller.",
    ),
    ("Pareto front", "the settings that no other beats in speed and size at once."),
    (
        "iterations",
        "of fitting values to pictures: each draws the decoded scene in two views and moves values to where the pictures miss less.",
    ),
    (
        "dc, sh",
        "the colour of a Gaussian, and how it changes with the direction of view (spherical harmonics).",
    ),
];

/// The end of the page.
pub(super) fn section() -> Markup {
    html! {
        section #terms {
            h2 { "Terms" }
            dl.terms {
                @for (term, meaning) in TERMS { dt { (term) } dd { (meaning) } }
            }
        }
    }
}
