//! What streams and codecs cost and what they look like: measured, tabled, drawn.
//!
//! * [`charting`] measures scenes over a [`sweep`] of settings: rate and speed against quality, operating points, what
//!   tools are worth. [`stability`] measures where codecs fail. Both give a page, tables and figures in memory: this
//!   crate prints nothing and writes no file.
//! * [`costs`] says where the bits of a stream go; [`table`] and [`numbers`] set reports for people; [`quantile`] ranks values.
//!
//! The command line parses what is asked for, reads scenes, and writes what comes out.

pub mod charting;
pub mod costs;
pub mod first_frame;
pub mod numbers;
pub mod peers;
pub mod quantile;
pub mod scenes;
pub mod stability;
pub mod statistics;
pub mod summary;
pub mod sweep;
pub mod table;

mod columns;
mod csv_files;
mod decoding;
mod error;
mod figures;
mod footprint;
mod front;
mod front_figures;
mod gop;
mod levels;
mod measure;
mod modes;
mod page;
mod picture_comparison;
mod pictures;
mod progress;
mod report;
mod scene_chart;
mod svg;
mod timing;
mod variant_comparison;

pub use error::Error;
pub use footprint::Footprint;
pub use progress::Progress;
pub use report::{File, Report};
