//! Temporary.
#![allow(missing_docs, clippy::unwrap_used, clippy::print_stdout, clippy::print_stderr, reason = "experiment")]
use splatstream_decoder::output::to_gaussians;
use splatstream_decoder::operating_point::OperatingPoint;
use splatstream_decoder::process::{Decoder, Options};
use splatstream_encoder::{Finetune, FrameSource, Settings, encode};
use splatstream_format::unit::Stream;
use splatstream_gaussians::GaussianFrame;
use splatstream_render::camera::{Up, ring};
use splatstream_render::ReferencePictures;
use std::time::Instant;

struct One(GaussianFrame);
impl FrameSource for One {
    fn len(&self) -> u32 { 1 }
    fn frame(&mut self, _: u32) -> Result<GaussianFrame, Box<dyn std::error::Error + Send + Sync>> { Ok(self.0.clone()) }
}
fn decode(bytes: &[u8], top: u8) -> GaussianFrame {
    let limits = splatstream_format::Limits::default();
    let stream = Stream::open(bytes, &limits).unwrap();
    let mut decoder = Decoder::new(stream.header(), Options { limits, operating_point: OperatingPoint { spatial: top, ..OperatingPoint::ALL }, ..Options::default() });
    let mut out = None;
    let mut units = stream.units();
    while let Some(unit) = units.next_unit() {
        for f in decoder.unit(&unit.unwrap()) { out = Some(f); }
    }
    for f in decoder.finish() { out = Some(f); }
    to_gaussians(out.unwrap().into_shown(), decoder.sequence().unwrap()).unwrap()
}
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let (path, db, iterations) = (&args[1], args[2].parse::<f32>().unwrap(), args[3].parse::<u32>().unwrap());
    let frame = splatstream_files::read_scene(std::path::Path::new(path), &splatstream_files::ReadLimits::default()).unwrap();
    let views = ReferencePictures::new(&frame, ring(&frame, Up::default(), 7, 540));
    let layers = std::env::var("LAYERS").ok().and_then(|t| t.parse().ok()).unwrap_or(1_u8);
    let report = |name: &str, bytes: &[u8], report: &splatstream_encoder::Report, seconds: f64| {
        let decoded = decode(bytes, u8::MAX);
        if layers > 1 {
            let lowest = decode(bytes, 0);
            let limits = splatstream_format::Limits::default();
            let stream = Stream::open(bytes, &limits).unwrap();
            let mut units = stream.units();
            let mut size = 0;
            while let Some(unit) = units.next_unit() {
                let unit = unit.unwrap();
                if unit.header.spatial_layer == 0 { size += unit.payload.len(); }
            }
            println!("  I540: {:.3} bpg {:.3} dB", 8.0 * size as f64 / report.gaussians as f64, views.psnr(&lowest).sum::<f64>() / 7.0);
        }
        let psnr = views.psnr(&decoded).sum::<f64>() / 7.0;
        println!("{name} {:?} bpg {:.3} held out {:.3} dB ring7 {psnr:.3} dB {seconds:.1}s sh entries {}", report.finetuned, 8.0 * bytes.len() as f64 / report.gaussians as f64,
            report.pictures.as_ref().unwrap().psnr().unwrap(), report.sh_codebook_entries);
    };
    let settings = Settings { psnr: Some(db), spatial_layers: layers, ..Settings::default() };
    let start = Instant::now();
    let mut out = Vec::new();
    let plain = encode(&mut One(frame.clone()), &settings, &mut out, &mut |_, _| ()).unwrap();
    report("fit  ", &out, &plain, start.elapsed().as_secs_f64());
    if std::env::var("TARGET").is_ok() {
        let start = Instant::now();
        let mut out = Vec::new();
        let settings = Settings { finetune: Some(Finetune { iterations, ..Finetune::default() }), ..settings };
        let tuned = encode(&mut One(frame.clone()), &settings, &mut out, &mut |_, _| ()).unwrap();
        report("tuned to target", &out, &tuned, start.elapsed().as_secs_f64());
        println!("{:?} {:?}", tuned.target, tuned.finetuned);
        return;
    }
    let given = Settings { psnr: None, verify: true, steps: plain.steps.unwrap(), laws: plain.laws.unwrap(), spatial_layers: layers, ..Settings::default() };
    let start = Instant::now();
    let mut out = Vec::new();
    let settings = Settings { finetune: Some(Finetune { iterations, ..Finetune::default() }), ..given };
    let tuned = encode(&mut One(frame.clone()), &settings, &mut out, &mut |_, _| ()).unwrap();
    report("tuned", &out, &tuned, start.elapsed().as_secs_f64());
}
