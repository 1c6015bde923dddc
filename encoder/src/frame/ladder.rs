//! What each spatial layer of an I frame adds.
//!
//! Pictures gain most from having all Gaussians, then from having the important ones exactly. So the lowest layer has all
//! Gaussians with coarse steps, and each layer above brings some of the lists, the most important first, to their final
//! steps. Every list is refined once. A factor of three makes coarse values points of the fine grid: what refines them is
//! -1, 0 or 1, which takes 1.58 bits where the finer step alone would take 1.5 more. A second time would cost as much again.
//!
//! Log-scales have their final steps from the start. Measured on real scenes, coarse ones spoil the picture of the lowest
//! layer as much as a coarser quantiser of everything would, and the steps of all other attributes follow from them.

use super::grain::Grain;
use splatstream_format::syntax::MAX_ATTRIBUTE_STEP;

/// Half octaves by which steps are coarser until they are refined: log_scale, opacity, rotation, dc, sh. Three are a
/// factor of three, nearly.
const COARSER: [u8; 5] = [0, 3, 3, 3, 3];

/// Low bits of positions that are left to the refinement.
const COARSER_POSITION: u8 = 2;

/// Which layer refines each list.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Ladder {
    /// By refinement.
    refined_at: Vec<u8>,
}

impl Ladder {
    /// Of so many spatial layers, for lists up to these shares of the Gaussians, percent, of which the last is 100.
    #[expect(clippy::indexing_slicing, reason = "lists are below the number of shares; stages are constants")]
    #[expect(clippy::arithmetic_side_effects, reason = "layers, rungs and shares are at most 100")]
    pub(crate) fn new(layers: u8, percents: &[u8]) -> Self {
        let rungs = layers.saturating_sub(1);
        let last = percents.len().saturating_sub(1);
        let mut refined_at = vec![0; percents.len()];
        // The end of each rung is the list whose share is nearest to an equal part of all Gaussians, but one after that of
        // the rung before, and so that each rung after it has a list.
        let mut start = 0;
        for rung in 1..=rungs {
            let part = 100 * usize::from(rung) / usize::from(rungs);
            let most = last.saturating_sub(usize::from(rungs - rung));
            let apart = |&list: &usize| usize::from(percents[list]).abs_diff(part);
            let end = (start..=most).min_by_key(apart).filter(|_| rung < rungs).unwrap_or(last);
            refined_at.get_mut(start..=end).into_iter().flatten().for_each(|layer| *layer = rung);
            start = end + 1;
        }
        Self { refined_at }
    }

    /// The most layers that have something to add to so many lists.
    pub(crate) fn most_layers(lists: usize) -> u8 {
        u8::try_from(lists).unwrap_or(u8::MAX).saturating_add(1)
    }

    /// Whether a layer brings a list to its final steps.
    pub(crate) fn refines(&self, layer: u8, list: usize) -> bool {
        layer > 0 && self.refined_at.get(list) == Some(&layer)
    }

    /// Whether a list has its final steps in a layer.
    pub(crate) fn is_final(&self, layer: u8, list: usize) -> bool {
        self.refined_at.get(list).is_none_or(|&refined| refined <= layer)
    }

    /// Whether a layer or one above it brings a list to its final steps.
    pub(crate) fn refines_from(&self, layer: u8) -> bool {
        self.refined_at.iter().any(|&refined| refined >= layer.max(1))
    }

    /// How finely a layer codes a list whose final steps are `last`. Entries of codebooks keep their step: no layer
    /// refines them.
    #[expect(clippy::indexing_slicing, reason = "lists are below the number of shares; stages are constants")]
    #[expect(clippy::arithmetic_side_effects, reason = "layers, rungs and shares are at most 100")]
    pub(crate) fn grain(
        &self,
        layer: u8,
        list: usize,
        last: Grain,
        has_books: bool,
        position_bits: u8,
    ) -> Grain {
        if self.is_final(layer, list) {
            return last;
        }
        let coarse = |stage: usize| (last.attribute_step[stage] + COARSER[stage]).min(MAX_ATTRIBUTE_STEP);
        let [scale, opacity, rotation, dc, sh] = [0, 1, 2, 3, 4].map(coarse);
        let sh = if has_books { last.attribute_step[4] } else { sh };
        Grain {
            position_shift: (last.position_shift + COARSER_POSITION).min(position_bits - 1),
            attribute_step: [scale, opacity, rotation, dc, sh],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn layers_refine_equal_parts_of_the_gaussians() {
        let usual = [10, 20, 30, 50, 100];
        assert_eq!(Ladder::new(1, &usual).refined_at, [0; 5]);
        assert_eq!(Ladder::new(2, &usual).refined_at, [1; 5]);
        assert_eq!(Ladder::new(3, &usual).refined_at, [1, 1, 1, 1, 2]);
        assert_eq!(Ladder::new(4, &usual).refined_at, [1, 1, 1, 2, 3]);
        assert_eq!(Ladder::new(3, &[30, 100]).refined_at, [1, 2]);
        assert_eq!(Ladder::new(4, &[5, 10, 100]).refined_at, [1, 2, 3]);
        assert_eq!(Ladder::new(2, &[100]).refined_at, [1]);
    }

    #[test]
    fn a_list_is_coarse_until_a_layer_refines_it() {
        let ladder = Ladder::new(3, &[50, 100]);
        let last = Grain { position_shift: 1, attribute_step: [5, 6, 7, 8, 23] };
        let coarse = Grain { position_shift: 1 + COARSER_POSITION, attribute_step: [5, 9, 10, 11, 24] };
        let grains = [0, 1, 2].map(|layer| [0, 1].map(|list| ladder.grain(layer, list, last, false, 16)));
        assert_eq!(grains, [[coarse, coarse], [last, coarse], [last, last]]);
        assert_eq!([0, 1, 2].map(|layer| ladder.refines(layer, 1)), [false, false, true]);
        assert_eq!(ladder.grain(0, 0, last, true, 16).attribute_step[4], 23);
    }
}
