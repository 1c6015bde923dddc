//! A stream that arrives in pieces gives what the whole one gives, and each frame as soon as its units are there.
//!
//! A decoder takes units, not bytes: here is what a client does that reads from a network.

use super::Decoded;
use splatstream_decoder::process::{DecodedFrame, Decoder, Options};
use splatstream_format::syntax::UnitType;
use splatstream_format::unit::{Delivery, Stream};
use splatstream_format::{Class, Error, Result};

/// Decodes `bytes` as they arrive: up to each of `ends` in turn, then all.
pub fn holds(bytes: &[u8], options: &Options, ends: &[usize]) {
    let mut client = Client::new(options);
    let whole = Decoded::of(bytes, options);
    for &end in ends {
        let arrived = &bytes[..end];
        client.receive(arrived, false);
        let prefix = Decoded::of(arrived, options);
        let there = &client.decoded.frames;
        assert!(prefix.frames.starts_with(there), "a client shows what is not there");
        assert!(there.len() + 1 >= prefix.frames.len(), "a client keeps frames back");
        let is_cut = prefix.end.is_some_and(|error| error.class() == Class::Truncated);
        assert!(is_cut || client.has_ended || prefix.end == whole.end, "a part has an error of its own");
    }
    client.receive(bytes, true);
    assert_eq!(client.decoded, whole, "pieces give something else");
}

/// What has arrived of a stream, and what it gave.
struct Client<'a> {
    options: &'a Options,
    decoder: Option<Decoder<'a>>,
    /// Offset of the next unit; of the end unit, once that is there.
    at: u64,
    has_ended: bool,
    decoded: Decoded,
}

impl<'a> Client<'a> {
    fn new(options: &'a Options) -> Self {
        let decoded = Decoded { sequence: None, frames: Vec::new(), end: None };
        Self { options, decoder: None, at: 0, has_ended: false, decoded }
    }

    /// Takes the units that have arrived; `is_all` says that nothing more will.
    fn receive(&mut self, arrived: &'a [u8], is_all: bool) {
        while self.decoded.end.is_none() && !self.has_ended {
            match self.step(arrived) {
                // Of a unit that is not all there nothing was taken: it is tried again with more bytes.
                Err(error) if error.class() == Class::Truncated && !is_all => return,
                Err(error) => self.give_up(error),
                Ok(()) => {}
            }
        }
        if self.has_ended && is_all && self.decoded.end.is_none() {
            self.decoded.end = self.after_the_end(arrived).err();
        }
    }

    /// The next unit.
    fn step(&mut self, arrived: &'a [u8]) -> Result<()> {
        let stream = Stream::open(arrived, &self.options.limits)?;
        if self.decoder.is_none() {
            self.at = stream.units().position();
        }
        let decoder = self.decoder.get_or_insert_with(|| Decoder::new(stream.header(), *self.options));
        let mut units = stream.units_from(self.at);
        let Some(delivery) = units.next_unit() else { return Ok(()) };
        let frame = match delivery? {
            Delivery::Intact(unit) => {
                self.has_ended = unit.header.unit_type() == UnitType::End;
                decoder.unit(&unit)?
            }
            Delivery::Damaged(damaged) => decoder.damaged(&damaged).map(|()| None)?,
        };
        if !self.has_ended {
            self.at = units.position();
        }
        self.show(frame);
        Ok(())
    }

    /// The stream ends with this error, behind what was there of the frame that was arriving.
    fn give_up(&mut self, error: Error) {
        let cut = self.decoder.as_mut().map_or(Ok(None), Decoder::cut);
        self.decoded.end = Some(cut.as_ref().err().copied().unwrap_or(error));
        self.show(cut.ok().flatten());
    }

    fn show(&mut self, frame: Option<DecodedFrame>) {
        let Some(decoder) = &self.decoder else { return };
        if let (Some(sequence), Some(frame)) = (decoder.sequence(), frame) {
            self.decoded.sequence = Some(*sequence);
            self.decoded.frames.push(frame);
        }
    }

    /// Nothing follows the end unit.
    fn after_the_end(&self, arrived: &'a [u8]) -> Result<()> {
        let mut units = Stream::open(arrived, &self.options.limits)?.units_from(self.at);
        units.next_unit().transpose()?;
        units.next_unit().transpose().map(|_| ())
    }
}
