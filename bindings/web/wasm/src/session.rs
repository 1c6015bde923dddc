//! Bytes in, frames out.

use crate::order::Order;
#[cfg(feature = "packages")]
use crate::package::Package;
use crate::received::Received;
use crate::texels::{ROW, Texels};
use splatstream::scene::SceneDescription;
use splatstream::{Decoder, Error, Frame, OperatingPoint, Position, Slots};

/// Bytes of a stream that are kept at most, so that it can be sought in.
pub const MAX_STREAM: usize = 1 << 30;

/// What a call came to. The codes are those that JavaScript sees.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum Status {
    /// Done; of a frame, it is there.
    Done = 0,
    /// More bytes have to come first.
    NeedBytes = 1,
    /// After the last frame.
    End = 2,
    /// After the last frame, and something was lost there: the text says what.
    Incomplete = 3,
    /// Nothing more comes: the text says why.
    Failed = 4,
}

/// Decodes one stream, or plays one package.
pub struct Session {
    /// The package that is played, if it is one.
    #[cfg(feature = "packages")]
    pub package: Option<Package>,
    received: Received,
    decoder: Decoder,
    frame: Option<Frame>,
    slots: Slots,
    /// What the textures hold.
    pub texels: Texels,
    /// The order to draw in.
    pub order: Order,
    /// Numbers of the last call: see [`Session::decode`], [`Session::show`] and [`Session::describe`].
    pub numbers: Vec<f64>,
    /// What was lost, or why a call failed, line by line; the title after [`Session::describe`].
    pub text: String,
}

impl Default for Session {
    fn default() -> Self {
        let received = Received::default();
        Self {
            #[cfg(feature = "packages")]
            package: None,
            decoder: received.decoder(),
            received,
            frame: None,
            slots: Slots::new(0),
            texels: Texels::default(),
            order: Order::default(),
            numbers: Vec::new(),
            text: String::new(),
        }
    }
}

impl Session {
    /// Room for bytes that come next: see [`Received::room`]. None without memory, or if they are too many.
    pub fn room(&self, count: usize) -> Option<*mut u8> {
        let total = self.received.len().checked_add(count)?;
        (total <= MAX_STREAM).then(|| self.received.room(count))?
    }

    /// `count` bytes of the room have been filled.
    pub fn filled(&self, count: usize) {
        self.received.filled(count);
    }

    /// Takes a copy of bytes that come next; whether there was memory for it.
    pub fn push(&self, bytes: &[u8]) -> bool {
        self.received.push(bytes)
    }

    /// No more bytes will come.
    pub fn end(&self) {
        self.received.end();
    }

    /// Decodes the next frame. Numbers: index, seconds from the start, Gaussians, how many of these are carried over from
    /// an earlier frame in place of missing refinements, refinements shown, whether it is a keyframe, the operating point
    /// (spatial, temporal, refinement), whether it has a digest, its high and its low half, bytes of its units, the index
    /// up to which it stands, which is its own and 1 where frames that follow are decoded, whether the clock of playback goes on
    /// from it.
    pub fn decode(&mut self) -> Status {
        self.clear();
        #[cfg(feature = "packages")]
        if let Some(mut package) = self.package.take() {
            let status = self.decode_package(&mut package);
            self.package = Some(package);
            return status;
        }
        let frame = match self.decoder.next_frame() {
            Ok(Some(frame)) => frame,
            Ok(None) if self.decoder.is_finished() => return Status::End,
            Ok(None) => return Status::NeedBytes,
            Err(Error::Incomplete(warnings)) => {
                self.say(warnings.iter());
                return Status::Incomplete;
            }
            Err(error) => return self.fail(&error),
        };
        self.say(frame.warnings().iter());
        let until = frame.index().saturating_add(1);
        self.give(frame, until, false)
    }

    /// The next frame of a package.
    #[cfg(feature = "packages")]
    fn decode_package(&mut self, package: &mut Package) -> Status {
        match package.next_frame() {
            Ok(Some((frame, until))) => {
                self.say(package.warnings.drain(..));
                self.give(frame, until, package.is_jump())
            }
            Ok(None) if !package.is_ended() => Status::NeedBytes,
            Ok(None) if package.warnings.is_empty() => Status::End,
            Ok(None) => {
                self.say(package.warnings.drain(..));
                Status::Incomplete
            }
            Err(reason) => {
                self.text = reason;
                Status::Failed
            }
        }
    }

    fn give(&mut self, frame: Frame, until: u32, is_jump: bool) -> Status {
        let point = frame.operating_point();
        let digest = frame.digest().unwrap_or_default();
        self.numbers.extend([
            f64::from(frame.index()),
            frame.time().as_secs_f64(),
            frame.len() as f64,
            frame.carried() as f64,
            f64::from(frame.refinements()),
            f64::from(u8::from(frame.is_keyframe())),
        ]);
        self.numbers.extend([point.spatial, point.temporal, point.refinement].map(f64::from));
        self.numbers.push(f64::from(u8::from(frame.digest().is_some())));
        self.numbers.extend([(digest >> 32) as u32, digest as u32].map(f64::from));
        self.numbers.extend([frame.bytes() as f64, f64::from(until), f64::from(u8::from(is_jump))]);
        self.frame = Some(frame);
        Status::Done
    }

    /// Puts the frame into the slots and their texels. Numbers: slots, whether all textures are new, degree of the
    /// spherical harmonics, whether the scene was made for a compensated low-pass filter, Gaussians that keep their
    /// slot, that have appeared, and that have disappeared.
    pub fn show(&mut self) -> Status {
        self.numbers.clear();
        let Some(frame) = &self.frame else { return Status::NeedBytes };
        let is_small = frame.len() > self.slots.capacity();
        if is_small {
            // Room for an eighth more, so that a scene that grows slowly keeps its textures.
            let capacity = frame.len().saturating_add(frame.len() / 8).next_multiple_of(ROW);
            self.slots = Slots::new(capacity);
        }
        let update = match self.slots.update(frame) {
            Ok(update) => update,
            Err(error) => return self.fail(&error),
        };
        let is_new = is_small || update.has_new_planes;
        let everything = 0..self.slots.capacity();
        let ranges = if is_new { core::slice::from_ref(&everything) } else { &update.dirty };
        self.texels.write(self.slots.planes(), ranges, is_new);
        let gaussians = frame.gaussians();
        self.numbers.extend([
            self.slots.capacity() as f64,
            f64::from(u8::from(is_new)),
            f64::from(gaussians.sh_degree()),
            f64::from(u8::from(gaussians.antialiased())),
            update.kept as f64,
            update.appeared as f64,
            update.disappeared as f64,
        ]);
        Status::Done
    }

    /// Sorts the slots for a camera.
    pub fn sort(&mut self, position: [f32; 3], ahead: [f32; 3]) {
        self.order.sort(self.slots.planes(), position, ahead);
    }

    /// Goes to a frame: the next one has this index, or a higher one where that is missing.
    pub fn seek(&mut self, index: u32) -> Status {
        self.clear();
        #[cfg(feature = "packages")]
        if let Some(package) = &mut self.package {
            package.seek(index);
            return Status::Done;
        }
        match self.decoder.seek(Position::Frame(index)) {
            Ok(()) => Status::Done,
            Err(error) => self.fail(&error),
        }
    }

    /// Changes the operating point: from the next GOP on, and where it is lower on some axis, from the next frame on.
    /// A package has its own rule where all three are 255.
    pub fn set_point(&mut self, [spatial, temporal, refinement]: [u8; 3]) {
        #[cfg(feature = "packages")]
        if let Some(package) = &mut self.package {
            return package.choose([spatial, temporal, refinement]);
        }
        self.decoder.set_operating_point(OperatingPoint { spatial, temporal, refinement });
    }

    /// What the stream says of itself, once a frame has come. Numbers: frames or 0, seconds of a frame, the highest
    /// operating point (spatial, temporal, refinement), the code of the axis that points up, whether there is a
    /// background, its red, green and blue; then of each camera position, rotation w, x, y, z, and vertical field of
    /// view in radians. Text: the title.
    pub fn describe(&mut self) -> Status {
        self.clear_report();
        let decoder = self.decoder();
        let Some(point) = decoder.highest_point() else { return Status::NeedBytes };
        let duration = decoder.frame_duration().unwrap_or_default();
        let scene = self.scene().cloned().unwrap_or_default();
        let frames = self.frame_count();
        self.numbers.push(frames.into());
        self.numbers.push(duration.as_secs_f64());
        self.numbers.extend([point.spatial, point.temporal, point.refinement].map(f64::from));
        self.numbers.push(scene.up_axis.code().into());
        self.numbers.push(f64::from(u8::from(scene.background.is_some())));
        self.numbers.extend(scene.background.unwrap_or_default().map(f64::from));
        for camera in &scene.cameras {
            self.numbers.extend(camera.position.map(f64::from));
            self.numbers.extend(camera.rotation.map(f64::from));
            self.numbers.push(camera.vertical_field_of_view.into());
        }
        self.text = scene.title.unwrap_or_default();
        Status::Done
    }

    /// The decoder of what is shown.
    fn decoder(&self) -> &Decoder {
        #[cfg(feature = "packages")]
        if let Some(package) = &self.package {
            return package.decoder();
        }
        &self.decoder
    }

    /// What is said of the scene of what is shown.
    fn scene(&self) -> Option<&SceneDescription> {
        #[cfg(feature = "packages")]
        if let Some(package) = &self.package {
            return package.scene();
        }
        self.decoder.description()
    }

    fn frame_count(&self) -> u32 {
        #[cfg(feature = "packages")]
        if let Some(package) = &self.package {
            return package.frame_count();
        }
        self.decoder.frame_count().unwrap_or_default()
    }

    fn clear(&mut self) {
        self.frame = None;
        self.clear_report();
    }

    /// Empties numbers and text for the next answer.
    pub(crate) fn clear_report(&mut self) {
        self.numbers.clear();
        self.text.clear();
    }

    fn say<T: ToString>(&mut self, lines: impl Iterator<Item = T>) {
        self.text = lines.map(|line| line.to_string()).collect::<Vec<_>>().join("\n");
    }

    fn fail(&mut self, error: &Error) -> Status {
        self.text = error.to_string();
        Status::Failed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STREAM: &[u8] = include_bytes!("../../../../examples/talk.gss");

    #[test]
    fn pieces_give_the_frames_of_the_whole() {
        let whole: Vec<Option<u64>> =
            Decoder::from_bytes(STREAM).map(|frame| frame.ok().and_then(|frame| frame.digest())).collect();
        let mut session = Session::default();
        let mut digests = Vec::new();
        // After the last piece comes the end.
        for piece in STREAM.chunks(997).chain([&[][..]]) {
            match piece.is_empty() {
                true => session.end(),
                false => assert!(session.push(piece)),
            }
            while session.decode() == Status::Done {
                digests.push(Some((session.numbers[10] as u64) << 32 | session.numbers[11] as u64));
                assert_eq!(session.show(), Status::Done);
            }
        }
        assert_eq!(session.decode(), Status::End);
        assert_eq!(digests, whole);
    }

    #[test]
    fn a_stream_that_is_still_coming_can_be_sought_in() {
        let mut session = Session::default();
        assert!(session.push(&STREAM[..STREAM.len() * 3 / 4]));
        while session.decode() == Status::Done {}
        assert_eq!(session.seek(1), Status::Done);
        assert_eq!((session.decode(), session.numbers[0]), (Status::Done, 1.0));
        assert!(session.push(&STREAM[STREAM.len() * 3 / 4..]));
        session.end();
        assert_eq!(session.seek(3), Status::Done);
        assert_eq!((session.decode(), session.numbers[0]), (Status::Done, 3.0));
    }
}
