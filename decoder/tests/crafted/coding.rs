//! Values of a run of planes, whatever they are of, to models and blocks.

use super::contexts::BlockValues;
use super::scene::Shape;
use splatstream_format::entropy::frequencies::Frequencies;
use splatstream_format::entropy::layout::PlaneInfo;
use splatstream_format::entropy::model::PlaneModel;
use splatstream_format::entropy::token::split;
use splatstream_format::entropy::writer::{BlockWriter, PlaneEncoder};
use std::collections::BTreeMap;

/// The values `v` of 8.1 of one entry: the delta, and those of the planes after it.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Row {
    pub(crate) delta: Option<u64>,
    pub(crate) signed: Vec<i64>,
}

/// What is coded, and how a test wants it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Coding<'a> {
    pub(crate) planes: &'a [PlaneInfo],
    pub(crate) rows: &'a [Row],
    /// By plane; the default for planes that are not named.
    pub(crate) shapes: &'a BTreeMap<usize, Shape>,
    pub(crate) lanes_log2: u8,
    pub(crate) block_log2: u8,
}

impl Coding<'_> {
    fn shape(&self, plane: usize) -> Shape {
        self.shapes.get(&plane).cloned().unwrap_or_default()
    }

    /// The values of each block, for models with these biases.
    fn runs(&self, biases: &[i64]) -> Vec<BlockValues> {
        let run = |rows: &[Row]| {
            let deltas: Vec<u64> = rows.iter().filter_map(|row| row.delta).collect();
            let before = usize::from(!deltas.is_empty());
            let plane = |plane: usize| match plane.checked_sub(before) {
                None => Vec::new(),
                Some(place) => rows.iter().map(|row| row.signed[place]).collect(),
            };
            let values: Vec<Vec<i64>> = (0..self.planes.len()).map(plane).collect();
            BlockValues::new(self.planes, &deltas, &values, biases)
        };
        self.rows.chunks(1 << self.block_log2).map(run).collect()
    }

    fn length(&self, run: usize) -> usize {
        let size = 1 << self.block_log2;
        (self.rows.len() - run * size).min(size)
    }

    /// A model for each plane whose tables fit the values.
    pub(crate) fn models(&self) -> Vec<PlaneModel> {
        let biases: Vec<i64> = (0..self.planes.len()).map(|plane| self.shape(plane).bias.into()).collect();
        let runs = self.runs(&biases);
        (0..self.planes.len()).map(|plane| self.model(plane, &runs)).collect()
    }

    fn model(&self, plane: usize, runs: &[BlockValues]) -> PlaneModel {
        let Shape { bias, direct_log2, axes, tables } = self.shape(plane);
        let (tables, table_of_context) = tables.unwrap_or_else(|| {
            let contexts = axes[0].contexts() * axes[1].contexts();
            let mut counts = vec![vec![0_u64; 256]; contexts];
            for (place, run) in runs.iter().enumerate() {
                for i in 0..self.length(place) {
                    let context = usize::from(run.context(&axes, plane, i));
                    counts[context][usize::from(split(run.unsigned(plane, i), direct_log2).token)] += 1;
                }
            }
            let tables = counts.iter().map(|counts| Frequencies::from_counts(counts)).collect();
            (tables, (0..contexts as u8).collect())
        });
        PlaneModel { bias, direct_log2, axes, tables, table_of_context }
    }

    /// Whether a model of another unit has a frequency for every value of a plane.
    pub(crate) fn suits(&self, plane: usize, model: &PlaneModel) -> bool {
        let biases = vec![i64::from(model.bias); self.planes.len()];
        self.runs(&biases).iter().enumerate().all(|(place, run)| {
            (0..self.length(place)).all(|i| {
                let context = usize::from(run.context(&model.axes, plane, i));
                let table = &model.tables[usize::from(model.table_of_context[context])];
                let token = usize::from(split(run.unsigned(plane, i), model.direct_log2).token);
                table.of_token().get(token).is_some_and(|&frequency| frequency > 0)
            })
        })
    }

    /// The blocks coded with models.
    pub(crate) fn blocks(&self, models: &[PlaneModel]) -> Vec<Vec<u8>> {
        let biases: Vec<i64> = models.iter().map(|model| model.bias.into()).collect();
        let block = |(place, values): (usize, &BlockValues)| {
            let mut writer = BlockWriter::new(self.lanes_log2);
            for (plane, model) in models.iter().enumerate() {
                let length = self.length(place);
                let contexts: Vec<u8> = (0..length).map(|i| values.context(&model.axes, plane, i)).collect();
                let symbols = (0..length).map(|i| values.unsigned(plane, i));
                writer.plane(&PlaneEncoder::new(model), &contexts, symbols).unwrap();
            }
            writer.finish()
        };
        self.runs(&biases).iter().enumerate().map(block).collect()
    }
}
