//! Clients that ask a server of HTTP/1.1 for ranges of a file, all at once, and check every byte: what `.ci/reports crowd`
//! measures with.
#![allow(clippy::print_stdout, reason = "it is a program")]

use std::env;
use std::error::Error;
use std::fs;
use std::io::{self, BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::thread;
use std::time::{Duration, Instant};

/// Bytes of a range.
const RANGE: usize = 100_000;

type Result<T> = std::result::Result<T, Box<dyn Error + Send + Sync>>;

/// Asks until the end; the time of each answer.
fn ask(address: &str, target: &str, whole: &[u8], seed: usize, end: Instant) -> Result<Vec<Duration>> {
    let mut socket = BufReader::new(TcpStream::connect(address)?);
    socket.get_ref().set_read_timeout(Some(Duration::from_secs(60)))?;
    let (mut times, mut body) = (Vec::new(), vec![0; RANGE]);
    while Instant::now() < end {
        let begun = Instant::now();
        let first = (seed * 7_919 + times.len() * 104_729) % (whole.len() - RANGE);
        let last = first + RANGE - 1;
        let request =
            format!("GET {target} HTTP/1.1\r\nHost: {address}\r\nRange: bytes={first}-{last}\r\n\r\n");
        socket.get_mut().write_all(request.as_bytes())?;
        let status = head(&mut socket)?;
        socket.read_exact(&mut body)?;
        if !status.starts_with("HTTP/1.1 206") || whole.get(first..=last) != Some(&body[..]) {
            return Err(format!("{first}-{last}: {status}").into());
        }
        times.push(begun.elapsed());
    }
    Ok(times)
}

/// The first line of an answer, with the others read.
fn head(socket: &mut impl BufRead) -> io::Result<String> {
    let mut status = String::new();
    socket.read_line(&mut status)?;
    let mut line = String::from("headers");
    while !line.trim_end().is_empty() {
        line.clear();
        socket.read_line(&mut line)?;
    }
    Ok(status.trim_end().to_owned())
}

fn main() -> Result<()> {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let [address, target, file, clients, seconds] = arguments.as_slice() else {
        return Err(
            "arguments: HOST:PORT TARGET FILE CLIENTS SECONDS; FILE is what TARGET names, 200 kB or more"
                .into(),
        );
    };
    let (whole, clients, seconds) = (fs::read(file)?, clients.parse::<usize>()?, seconds.parse()?);
    if whole.len() < 2 * RANGE {
        return Err(format!("{file}: shorter than {} bytes", 2 * RANGE).into());
    }
    let end = Instant::now() + Duration::from_secs(seconds);
    let results: Vec<Result<Vec<Duration>>> = thread::scope(|scope| {
        let threads: Vec<_> = (0..clients)
            .map(|seed| {
                let whole = &whole;
                scope.spawn(move || ask(address, target, whole, seed, end))
            })
            .collect();
        threads.into_iter().map(|thread| thread.join().map_err(|_| "a client panicked")?).collect()
    });
    let mut times = results.into_iter().collect::<Result<Vec<_>>>()?.concat();
    times.sort();
    let time =
        |share: usize| times.get(times.len() * share / 100).copied().unwrap_or_default().as_secs_f64() * 1e3;
    let rate = times.len() as f64 / seconds as f64;
    println!(
        "{clients} clients, {seconds} s: {} requests without an error, {rate:.0} a second, {:.0} MB/s",
        times.len(),
        rate * RANGE as f64 / 1e6
    );
    println!("an answer took {:.1} ms in the median, {:.1} ms at 99 %", time(50), time(99));
    Ok(())
}
