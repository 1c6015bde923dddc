//! The cases: each with what is wrong and how much of it.

use super::base::{Base, Size};
use super::sample::Sample;
use super::{scenes, sequences};
use splatstream_gaussians::GaussianFrame;

/// Something that a codec may fail at.
pub(super) struct Case {
    /// Unique, and a part of the names of files.
    pub(super) id: &'static str,
    /// A heading.
    pub(super) title: &'static str,
    /// What is done to the base, in a sentence.
    pub(super) what: &'static str,
    /// What a strength is.
    pub(super) axis: &'static str,
    /// How samples are made.
    pub(super) make: Make,
    /// Strengths, rising.
    strengths: &'static [f64],
    /// More of them, of a full run.
    more: &'static [f64],
}

/// How a base and a strength become a sample.
#[derive(Clone, Copy)]
pub(super) enum Make {
    /// From the scene.
    Scene(fn(&GaussianFrame, f64) -> Sample),
    /// From the sequence.
    Sequence(fn(&Base, f64) -> Sample),
    /// The sequence itself; units of its stream are lost.
    Loss,
}

impl Case {
    /// The strengths that are measured, rising.
    pub(super) fn strengths(&self, size: Size) -> Vec<f64> {
        let mut strengths = match size {
            Size::Quick => self.strengths.last().copied().into_iter().collect(),
            Size::Standard => self.strengths.to_vec(),
            Size::Full => [self.strengths, self.more].concat(),
        };
        strengths.sort_by(f64::total_cmp);
        strengths
    }

    /// Whether a base has what it needs.
    pub(super) fn fits(&self, base: &Base) -> bool {
        matches!(self.make, Make::Scene(_)) || base.len() > 1
    }
}

/// The cases that a base has.
pub(super) fn of(base: &Base) -> impl Iterator<Item = &'static Case> {
    SCENES.iter().chain(&SEQUENCES).filter(|case| case.fits(base))
}

static SCENES: [Case; 10] = [
    Case {
        id: "far-2",
        title: "Far background, 2 %",
        what: "2 % of the Gaussians are further from the middle by a factor and as much larger, as sky and street are",
        axis: "factor of the distance",
        make: Make::Scene(|scene, factor| scenes::far(scene, 0.02, factor)),
        strengths: &[10.0, 100.0, 1000.0],
        more: &[30.0, 300.0, 1e4],
    },
    Case {
        id: "far-10",
        title: "Far background, 10 %",
        what: "the same with 10 % of the Gaussians",
        axis: "factor of the distance",
        make: Make::Scene(|scene, factor| scenes::far(scene, 0.1, factor)),
        strengths: &[10.0, 100.0, 1000.0],
        more: &[30.0, 300.0, 1e4],
    },
    Case {
        id: "floater-visible",
        title: "Floater",
        what: "one more Gaussian, opaque, many scene sizes away, as training leaves them",
        axis: "distance, scene sizes",
        make: Make::Scene(|scene, distance| scenes::floater(scene, distance, true)),
        strengths: &[1e2, 1e4, 1e6, 1e10],
        more: &[1e3, 1e5, 1e8],
    },
    Case {
        id: "floater-invisible",
        title: "Invisible floater",
        what: "the same, but so transparent that no picture shows it",
        axis: "distance, scene sizes",
        make: Make::Scene(|scene, distance| scenes::floater(scene, distance, false)),
        strengths: &[1e2, 1e4, 1e6, 1e10],
        more: &[1e3, 1e5, 1e8],
    },
    Case {
        id: "absurd",
        title: "Absurd colours",
        what: "1 % of the Gaussians have a dc that no screen can show",
        axis: "dc",
        make: Make::Scene(scenes::absurd),
        strengths: &[1e2, 1e4, 1e6],
        more: &[10.0, 1e8],
    },
    Case {
        id: "needles",
        title: "Needles",
        what: "5 % of the Gaussians are stretched along their longest axis",
        axis: "factor of the length",
        make: Make::Scene(scenes::needles),
        strengths: &[2.0, 5.0, 20.0],
        more: &[10.0, 100.0],
    },
    Case {
        id: "unit",
        title: "Unit of length",
        what: "the whole scene is scaled, as if metres were millimetres; pictures are drawn with the scale taken out again",
        axis: "scale of the scene",
        make: Make::Scene(scenes::unit),
        strengths: &[1e-3, 1.0, 1e3],
        more: &[1e-6, 1e6],
    },
    Case {
        id: "count",
        title: "Few Gaussians",
        what: "only so many Gaussians of the scene are left",
        axis: "Gaussians",
        make: Make::Scene(scenes::count),
        strengths: &[0.0, 1.0, 2.0, 5.0],
        more: &[3.0, 10.0],
    },
    Case {
        id: "one-point",
        title: "All in one point",
        what: "a share of the Gaussians lie in exactly one point",
        axis: "share of the Gaussians",
        make: Make::Scene(scenes::one_point),
        strengths: &[0.5, 1.0],
        more: &[0.1, 0.9],
    },
    Case {
        id: "transparent",
        title: "Opacity 0",
        what: "a share of the Gaussians has no opacity",
        axis: "share of the Gaussians",
        make: Make::Scene(scenes::transparent),
        strengths: &[0.1, 1.0],
        more: &[0.5, 0.9],
    },
];

static SEQUENCES: [Case; 11] = [
    Case {
        id: "mixed-sh",
        title: "Mixed degrees",
        what: "frames with spherical harmonics of a degree and frames without take turns",
        axis: "degree",
        make: Make::Sequence(sequences::mixed_degrees),
        strengths: &[1.0, 3.0],
        more: &[2.0],
    },
    Case {
        id: "counts",
        title: "Changing counts",
        what: "every second frame has fewer Gaussians by a factor",
        axis: "factor",
        make: Make::Sequence(sequences::counts),
        strengths: &[2.0, 10.0],
        more: &[5.0, 50.0],
    },
    Case {
        id: "cuts",
        title: "Scene cuts",
        what: "the sequence is cut to another scene and back, at even distances; no row keeps its meaning",
        axis: "cuts",
        make: Make::Sequence(sequences::cuts),
        strengths: &[1.0, 3.0, 7.0],
        more: &[15.0],
    },
    Case {
        id: "motion",
        title: "Global motion",
        what: "everything moves by a share of the scene's width from frame to frame; no row keeps its meaning",
        axis: "share of the width",
        make: Make::Sequence(sequences::motion),
        strengths: &[0.01, 0.03, 0.1],
        more: &[0.3, 1.0],
    },
    Case {
        id: "abab",
        title: "A B A B",
        what: "a share of the scene has another place and colour in every second frame; no row keeps its meaning",
        axis: "share of the Gaussians",
        make: Make::Sequence(sequences::alternating),
        strengths: &[0.1, 0.5, 1.0],
        more: &[0.3],
    },
    Case {
        id: "noise",
        title: "Noise",
        what: "every attribute has noise of its own in each frame",
        axis: "share of the attribute's deviation",
        make: Make::Sequence(sequences::noise),
        strengths: &[0.003, 0.03, 0.3],
        more: &[0.01, 0.1],
    },
    Case {
        id: "zoom",
        title: "Zoom",
        what: "everything grows from frame to frame, and cameras step back as much; no row keeps its meaning",
        axis: "factor a frame",
        make: Make::Sequence(sequences::zoom),
        strengths: &[1.01, 1.1, 1.5],
        more: &[2.0],
    },
    Case {
        id: "fade",
        title: "Fade",
        what: "opacity falls evenly over the sequence",
        axis: "share lost at the end",
        make: Make::Sequence(sequences::fade),
        strengths: &[0.5, 1.0],
        more: &[0.9],
    },
    Case {
        id: "chain",
        title: "Long chain",
        what: "one GOP, each frame predicted from the one before; only the last frame is judged",
        axis: "frames",
        make: Make::Sequence(sequences::chain),
        strengths: &[1.0, 8.0, 32.0],
        more: &[100.0, 300.0],
    },
    Case {
        id: "far-last",
        title: "Far larger last frame",
        what: "the last frame is larger by a factor; the others are judged",
        axis: "factor",
        make: Make::Sequence(sequences::far_last),
        strengths: &[10.0, 100.0, 1e4],
        more: &[1e6],
    },
    Case {
        id: "loss",
        title: "Lost units",
        what: "units of frames are lost at random; a frame that is lost is replaced by the one before; means of several trials",
        axis: "share of the units",
        make: Make::Loss,
        strengths: &[0.01, 0.05, 0.2],
        more: &[0.02, 0.1, 0.5],
    },
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cases_have_names_of_their_own_and_strengths_rise() {
        let mut ids: Vec<&str> = SCENES.iter().chain(&SEQUENCES).map(|case| case.id).collect();
        ids.sort_unstable();
        assert!(ids.is_sorted_by(|a, b| a < b));
        for case in SCENES.iter().chain(&SEQUENCES) {
            let [quick, standard, full] =
                [Size::Quick, Size::Standard, Size::Full].map(|size| case.strengths(size));
            assert_eq!(quick, standard[standard.len() - 1..]);
            assert!(full.len() > standard.len() && full.is_sorted_by(|a, b| a < b), "{}", case.id);
        }
    }
}
