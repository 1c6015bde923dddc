//! Clause 7.7 for a unit with one new Gaussian: neighbours, weights, means.

use super::walk::{Common, Step};
use super::{list, of};
use splatstream_decoder::frame::QuantizedFrame;
use splatstream_decoder::increment::prediction::{Predicting, Prediction};
use splatstream_decoder::increment::residual::{AttributeValues, Attributes};
use splatstream_decoder::interrupt::Interrupt;
use splatstream_decoder::layout::Section;
use splatstream_decoder::list::{FINE, canonical};
use splatstream_decoder::neighbours::{Neighbour, NeighbourSearch};
use splatstream_decoder::predictor::{Predictor, WeightedMean, bilateral_weights, knn_weights};
use splatstream_decoder::steps::Stage;
use std::fmt::Write as _;

/// The new Gaussian and its neighbours.
struct Case<'s> {
    step: &'s Step,
    predictor: Predictor,
    near: Vec<Neighbour>,
    /// `feature` of each neighbour so far.
    features: Vec<u64>,
}

/// What attributes are predicted here.
const NAMES: [(Stage, &str); 4] = [
    (Stage::LogScale, "log_scale"),
    (Stage::Opacity, "opacity"),
    (Stage::Rotation, "rotation"),
    (Stage::Dc, "dc"),
];

/// The only new Gaussian of a unit, predicted and reconstructed by the decoder.
pub(crate) fn prediction(text: &mut String, common: &Common, step: &Step, title: &str) {
    let planes = &step.list.planes;
    let row = step.list.len() - 1;
    let point = of(&planes.position, row);
    let predictor = Predictor::from_code(step.values.plane(Section::Predictors, 0)[0], 0).unwrap();
    let mut near = Vec::new();
    let set = &step.set;
    NeighbourSearch::new(set.position.each_ref().map(Vec::as_slice)).nearest(
        point,
        step.header.neighbour_count.into(),
        &mut near,
    );
    let mut case = Case { step, predictor, features: vec![0; near.len()], near };
    write!(
        text,
        "\n## {title}\n\nThe new Gaussian of unit {} at {}, by 7.7. Its reference set (SS-PR-001), with K = {}:\n\n\
         | Index | position | D2 | Neighbour | q | o | rotation | dc |\n|---|---|---|---|---|---|---|---|\n",
        step.name(),
        list(point),
        case.near.len()
    )
    .unwrap();
    case.reference_set(text, point);
    case.attributes(text, common);
}

impl Case<'_> {
    fn reference_set(&self, text: &mut String, point: [u32; 3]) {
        let set = &self.step.set;
        for i in 0..set.len() {
            let at = of(&set.position, i);
            let squares = at.iter().zip(point).map(|(&a, b)| u64::from(a.abs_diff(b)).pow(2));
            let rank = self.near.iter().position(|neighbour| neighbour.index as usize == i);
            let cells = [
                list(at),
                squares.sum::<u64>().to_string(),
                rank.map_or_else(|| "none".to_owned(), |rank| rank.to_string()),
                list(of(&set.log_scale, i)),
                set.opacity[i].to_string(),
                list(of(&set.rotation, i)),
                list(of(&set.dc, i)),
            ];
            writeln!(text, "| {i} | {} |", cells.join(" | ")).unwrap();
        }
    }

    /// Attribute by attribute: weights, means, residual, what comes out.
    fn attributes(&mut self, text: &mut String, common: &Common) {
        let step = self.step;
        let coding = common.coding(&step.header);
        let at: [Vec<u32>; 3] =
            step.list.planes.position.each_ref().map(|plane| vec![*plane.last().unwrap()]);
        let position = at.each_ref().map(Vec::as_slice);
        let by = Predicting {
            header: &step.header,
            colour: coding.colour,
            network: None,
            feature_shift: 0,
            interrupt: Interrupt::NEVER,
        };
        let mut decoder = Prediction::new(&step.set, position, &[self.predictor], &by).unwrap();
        let mut known = Attributes::unpredicted(1, &coding.colour, 0);
        let values = AttributeValues(&step.values.section(Section::New).planes);
        let mut rows = String::new();
        if self.predictor == Predictor::Knn {
            writeln!(text, "\nThe weights of the neighbours, for all attributes: {}.", list(self.weights()))
                .unwrap();
        } else {
            text.push_str("\n| Attribute | feature | far | unlike | weight |\n|---|---|---|---|---|\n");
        }
        for (stage, name) in NAMES {
            if self.predictor == Predictor::Bilateral {
                self.weight_row(text, name);
            }
            decoder.predict(stage, &mut known);
            let predicted = planes(stage, &known);
            assert_eq!(predicted, self.means(stage), "means of {name}");
            known.add_stage(stage, values, &coding, 0).unwrap();
            decoder.learn(stage, &known);
            self.learn(stage, &known);
            let residual = values.of_stage(stage, &coding.colour).iter().map(|plane| plane[0]);
            let (p, v, result) = (list(predicted), list(residual), list(planes(stage, &known)));
            writeln!(rows, "| {name} | {p} | {v} | {result} |").unwrap();
        }
        write!(text, "\n| Attribute | pred | v | Reconstructed |\n|---|---|---|---|\n{rows}").unwrap();
        text.push_str("\nOf rotation, pred and the reconstructed value are `rotation_fine`.\n");
        self.one_mean(text);
        let row = step.list.len() - 1;
        assert_eq!(planes(Stage::LogScale, &known), of(&step.list.planes.log_scale, row));
        assert_eq!(planes(Stage::Rotation, &known), of(&step.list.rotation_fine, row));
        assert_eq!(planes(Stage::Dc, &known), of(&step.list.planes.dc, row));
    }

    fn weights(&self) -> Vec<i64> {
        let header = &self.step.header;
        let weights = match self.predictor {
            Predictor::Bilateral => bilateral_weights(
                &self.near,
                header.bilateral_spatial,
                header.bilateral_feature,
                &self.features,
            ),
            _ => knn_weights(&self.near),
        };
        weights[..self.near.len()].to_vec()
    }

    fn weight_row(&self, text: &mut String, name: &str) {
        let header = &self.step.header;
        let last = self.near.last().unwrap().distance + 1;
        let far = self.near.iter().map(|near| near.distance * u64::from(header.bilateral_spatial) / last);
        let unlike = self.features.iter().map(|f| ((f * u64::from(header.bilateral_feature)) >> 6).min(255));
        let (features, far, unlike) = (list(&self.features), list(far), list(unlike));
        writeln!(text, "| {name} | {features} | {far} | {unlike} | {} |", list(self.weights())).unwrap();
    }

    fn neighbours(&self, plane: &[i32]) -> Vec<i32> {
        self.near.iter().map(|neighbour| plane[neighbour.index as usize]).collect()
    }

    fn means(&self, stage: Stage) -> Vec<i32> {
        let unit = if stage == Stage::Rotation { FINE } else { 1 };
        let weighted = WeightedMean::new(&self.weights());
        let mean = |plane: &Vec<i32>| weighted.of(self.neighbours(plane).into_iter()) * unit;
        set_planes(stage, &self.step.set).into_iter().map(mean).collect()
    }

    fn learn(&mut self, stage: Stage, known: &Attributes) {
        let scale = |value: i32| if stage == Stage::Rotation { canonical(value) } else { value };
        for (own, plane) in planes(stage, known).into_iter().zip(set_planes(stage, &self.step.set)) {
            let theirs = self.neighbours(plane);
            for (f, theirs) in self.features.iter_mut().zip(theirs) {
                *f += u64::from(scale(own).abs_diff(theirs)).pow(2);
            }
        }
    }

    /// The first mean in full, with the weights that log-scales have.
    fn one_mean(&self, text: &mut String) {
        let first = Self { features: vec![0; self.near.len()], near: self.near.clone(), ..*self };
        let (weights, x) = (first.weights(), self.neighbours(&self.step.set.log_scale[0]));
        let total: i64 = weights.iter().sum();
        let sum: i64 = weights.iter().zip(&x).map(|(weight, &x)| weight * i64::from(x)).sum();
        let (top, bottom) = (2 * sum + total, 2 * total);
        write!(
            text,
            "\nThe mean that is `pred.q[0]`:\n\n```text\nweight           = {}\nx                = {}\ntotal            = {total}\n\
             sum              = {sum}\n(2 * sum + total) / (2 * total) = {top} / {bottom} = {}\n```\n",
            list(&weights),
            list(&x),
            WeightedMean::new(&weights).of(x.iter().copied())
        )
        .unwrap();
        assert_eq!(top.div_euclid(bottom), i64::from(WeightedMean::new(&weights).of(x.into_iter())));
    }
}

fn planes(stage: Stage, known: &Attributes) -> Vec<i32> {
    let planes: Vec<&Vec<i32>> = match stage {
        Stage::LogScale => known.log_scale.iter().collect(),
        Stage::Opacity => vec![&known.opacity],
        Stage::Rotation => known.rotation_fine.iter().collect(),
        Stage::Dc => known.dc.iter().collect(),
        Stage::Sh => known.sh.iter().collect(),
    };
    planes.into_iter().map(|plane| plane[0]).collect()
}

fn set_planes(stage: Stage, set: &QuantizedFrame) -> Vec<&Vec<i32>> {
    match stage {
        Stage::LogScale => set.log_scale.iter().collect(),
        Stage::Opacity => vec![&set.opacity],
        Stage::Rotation => set.rotation.iter().collect(),
        Stage::Dc => set.dc.iter().collect(),
        Stage::Sh => set.sh.iter().collect(),
    }
}
