//! The functions that JavaScript sees of a package, beside those of [`exports`](crate::exports). Times are microseconds of a
//! clock of the page. What is too large for a number is written to [`gss_package_room`].
#![expect(unsafe_code, reason = "an exported name may meet another one of the program")]

use crate::exports::with;
use crate::package::Package;
use crate::session::{Session, Status};
use splatstream_stream::playback::{Command, Fault};
use std::cell::RefCell;

/// Bytes that are written at once, at most.
const MOST: usize = 1 << 28;

thread_local! {
    static ROOM: RefCell<Vec<u8>> = const { RefCell::new(Vec::new()) };
}

fn package(work: impl FnOnce(&mut Package)) {
    with(|session| session.package.as_mut().map(work));
}

fn microseconds(now: f64) -> u64 {
    // Saturates, and is 0 for what is no number.
    now as u64
}

/// Where `count` bytes are to be written that the next call takes; 0 if they are too many.
#[unsafe(no_mangle)]
pub extern "C" fn gss_package_room(count: usize) -> usize {
    ROOM.with_borrow_mut(|room| {
        room.clear();
        if count > MOST || room.try_reserve_exact(count).is_err() {
            return 0;
        }
        room.resize(count, 0);
        room.as_ptr().addr()
    })
}

/// Says a failure in the text.
fn say(session: &mut Session, result: Result<(), String>) -> u32 {
    session.clear_report();
    match result {
        Ok(()) => Status::Done as u32,
        Err(reason) => {
            session.text = reason;
            Status::Failed as u32
        }
    }
}

/// Opens the package whose manifest has been written; [`Status`], with the reason as text.
#[unsafe(no_mangle)]
pub extern "C" fn gss_package_open(now: f64) -> u32 {
    let opened = ROOM.with_borrow(|manifest| Package::open(manifest, microseconds(now)));
    with(|session| {
        let result = opened.map(|package| session.package = Some(package));
        say(session, result)
    })
}

/// [`Package::renew`] with the manifest that has been written; [`Status`], with the reason as text.
#[unsafe(no_mangle)]
pub extern "C" fn gss_package_renew() -> u32 {
    with(|session| {
        let Some(package) = &mut session.package else { return Status::NeedBytes as u32 };
        let result = ROOM.with_borrow(|manifest| package.renew(manifest));
        say(session, result)
    })
}

/// [`Package::polled`] with the manifest that has been written, or [`Package::unreadable`] with why it could not be read;
/// [`Status`], with the reason as text.
#[unsafe(no_mangle)]
pub extern "C" fn gss_package_polled(is_read: u32) -> u32 {
    with(|session| {
        let Some(package) = &mut session.package else { return Status::NeedBytes as u32 };
        let result = ROOM.with_borrow(|bytes| match is_read {
            0 => package.unreadable(&String::from_utf8_lossy(bytes)),
            _ => package.polled(bytes),
        });
        say(session, result)
    })
}

/// [`Package::clock`].
#[unsafe(no_mangle)]
pub extern "C" fn gss_package_clock(now: f64) {
    package(|package| package.clock(microseconds(now)));
}

/// What to do: 0 wait until the time in the numbers, 1 request, 2 give requests up, 3 read the manifest again, 4 read it beside all
/// else. Of requests the numbers are offsets and lengths, and the text the names of files, line by line.
#[unsafe(no_mangle)]
pub extern "C" fn gss_package_decide() -> u32 {
    with(|session| {
        session.clear_report();
        let Some(package) = &mut session.package else { return 0 };
        match package.decide() {
            Command::Wait { until_us } => {
                session.numbers.push(until_us as f64);
                0
            }
            Command::Fetch(requests) => {
                let names: Vec<&str> = requests.iter().map(|request| request.file.as_str()).collect();
                session.text = names.join("\n");
                let ranges = requests.iter().flat_map(|request| [request.offset as f64, request.size as f64]);
                session.numbers.extend(ranges);
                1
            }
            Command::Abandon => 2,
            Command::ReadManifest => 3,
            Command::PollManifest => 4,
        }
    })
}

/// A request is sent.
#[unsafe(no_mangle)]
pub extern "C" fn gss_package_sent() {
    package(Package::sent);
}

/// A response begins.
#[unsafe(no_mangle)]
pub extern "C" fn gss_package_begun() {
    package(Package::begun);
}

/// The bytes have come that have been written; 0 if they are not what was packaged.
#[unsafe(no_mangle)]
pub extern "C" fn gss_package_received() -> u32 {
    let take = |bytes: &Vec<u8>| with(|session| session.package.as_mut().map(|one| one.received(bytes)));
    ROOM.with_borrow(take).unwrap_or_default().into()
}

/// The requests have failed: 0 a status, 1 what has been written as text, 2 a response that ends after `value` bytes, 3
/// something that is not the range asked for, 4 a file that is not the one before.
#[unsafe(no_mangle)]
pub extern "C" fn gss_package_failed(kind: u32, value: u32) {
    let words = ROOM.with_borrow(|text| String::from_utf8_lossy(text).into_owned());
    let fault = match kind {
        0 => Fault::Status(u16::try_from(value).unwrap_or(u16::MAX)),
        1 => Fault::Failed(words),
        2 => Fault::Short(value.into()),
        3 => Fault::Wrong("the server answers with another range of bytes"),
        _ => Fault::Changed,
    };
    package(|package| package.failed(&fault));
}

/// Whether what was requested is still wanted.
#[unsafe(no_mangle)]
pub extern "C" fn gss_package_is_fetching() -> u32 {
    with(|session| session.package.as_ref().is_some_and(Package::is_fetching)).into()
}

/// [`Package::is_better`].
#[unsafe(no_mangle)]
pub extern "C" fn gss_package_is_better() -> u32 {
    with(|session| session.package.as_ref().is_some_and(Package::is_better)).into()
}

/// [`Package::is_best`].
#[unsafe(no_mangle)]
pub extern "C" fn gss_package_is_best() -> u32 {
    with(|session| session.package.as_ref().is_some_and(Package::is_best)).into()
}

/// [`Package::run`].
#[unsafe(no_mangle)]
pub extern "C" fn gss_package_run(speed_milli: u32) {
    package(|package| package.run(speed_milli));
}

/// The numbers of [`Package::report`].
#[unsafe(no_mangle)]
pub extern "C" fn gss_package_report() {
    with(|session| {
        session.clear_report();
        if let Some(package) = &session.package {
            package.report(&mut session.numbers);
        }
    });
}
