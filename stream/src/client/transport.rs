//! Connections that end where a response goes on, and nothing of it is a body.
//!
//! After the last chunk of a response a server may send trailers, and before the first one any number of interim responses and
//! bodies of redirects. The library reads all of that without an end and without a pause, and hands out none of it, so only a
//! transport sees it. It counts what comes between two calls of [`progress`]: a call hands out bytes of the body as soon as
//! there are some, which is never later than with the second filling of the buffer.

use std::cell::Cell;
use std::io::{self, ErrorKind, Read};
use ureq::Error;
use ureq::unversioned::transport::{Buffers, ConnectionDetails, Connector, NextTimeout, Transport};

/// Bytes between two bytes of bodies, at most: twice what the buffer has, which holds all headers of a response.
const MOST: usize = 1 << 18;

thread_local! {
    /// Bytes that have come since the thread has asked for something.
    static IDLE: Cell<usize> = const { Cell::new(0) };
}

/// Says that the thread asks for the next bytes, or for a response.
pub(super) fn progress() {
    IDLE.set(0);
}

/// A body, each read of which is [`progress`].
pub(super) struct Body<R>(pub(super) R);

impl<R: Read> Read for Body<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        progress();
        self.0.read(buffer)
    }
}

/// Makes connections that count.
#[derive(Debug)]
pub(super) struct Counting;

impl<T: Transport> Connector<T> for Counting {
    type Out = Counted<T>;

    fn connect(&self, _: &ConnectionDetails<'_>, chained: Option<T>) -> Result<Option<Self::Out>, Error> {
        Ok(chained.map(Counted))
    }
}

/// A connection that counts.
#[derive(Debug)]
pub(super) struct Counted<T>(T);

impl<T: Transport> Transport for Counted<T> {
    fn buffers(&mut self) -> &mut dyn Buffers {
        self.0.buffers()
    }

    fn transmit_output(&mut self, amount: usize, timeout: NextTimeout) -> Result<(), Error> {
        self.0.transmit_output(amount, timeout)
    }

    fn await_input(&mut self, timeout: NextTimeout) -> Result<bool, Error> {
        let before = self.0.buffers().input().len();
        let made_progress = self.0.await_input(timeout)?;
        let came = self.0.buffers().input().len().saturating_sub(before);
        IDLE.set(IDLE.get().saturating_add(came));
        if IDLE.get() > MOST {
            let why = "the response goes on without a byte of a body";
            return Err(io::Error::new(ErrorKind::InvalidData, why).into());
        }
        Ok(made_progress)
    }

    fn is_open(&mut self) -> bool {
        self.0.is_open()
    }

    fn is_tls(&self) -> bool {
        self.0.is_tls()
    }
}
