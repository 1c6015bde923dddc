//! A client that sends what it is told to, byte for byte.

use std::io::{self, BufRead, BufReader, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::time::Duration;

/// An answer.
#[derive(Debug)]
pub(crate) struct Reply {
    pub(crate) status: u16,
    headers: Vec<(String, String)>,
    pub(crate) body: Vec<u8>,
    /// Whether the body has the length that the header says.
    pub(crate) is_whole: bool,
}

impl Reply {
    /// A header by its name in lower case; empty if there is none.
    pub(crate) fn header(&self, name: &str) -> &str {
        self.headers.iter().find(|(given, _)| given == name).map_or("", |(_, value)| value)
    }
}

/// A connection of HTTP/1.1.
pub(crate) struct Client {
    stream: BufReader<TcpStream>,
}

impl Client {
    pub(crate) fn connect(address: SocketAddr) -> Self {
        let stream = TcpStream::connect(address).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(30))).unwrap();
        stream.set_nodelay(true).unwrap();
        Self { stream: BufReader::new(stream) }
    }

    pub(crate) fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.stream.get_mut().write_all(bytes)
    }

    /// Sends a request; headers are lines without their ends.
    pub(crate) fn send(&mut self, method: &str, target: &str, headers: &[&str]) -> io::Result<()> {
        let mut request = format!("{method} {target} HTTP/1.1\r\nHost: localhost\r\n");
        headers.iter().for_each(|header| request += &format!("{header}\r\n"));
        self.write(format!("{request}\r\n").as_bytes())
    }

    /// The head of an answer, and the length of its body.
    pub(crate) fn head(&mut self) -> io::Result<(Reply, usize)> {
        let status = self.line()?;
        let status = status.split(' ').nth(1).and_then(|status| status.parse().ok());
        let status = status.ok_or(io::ErrorKind::UnexpectedEof)?;
        let mut headers = Vec::new();
        loop {
            let line = self.line()?;
            let Some((name, value)) = line.split_once(": ") else { break };
            headers.push((name.to_ascii_lowercase(), value.to_owned()));
        }
        let reply = Reply { status, headers, body: Vec::new(), is_whole: false };
        let length = reply.header("content-length").parse().unwrap_or(0);
        Ok((reply, length))
    }

    /// An answer to a method.
    pub(crate) fn receive(&mut self, method: &str) -> io::Result<Reply> {
        let (mut reply, length) = self.head()?;
        if method == "HEAD" || reply.status == 304 {
            reply.is_whole = true;
            return Ok(reply);
        }
        let length = u64::try_from(length).unwrap();
        let _broken = self.stream.by_ref().take(length).read_to_end(&mut reply.body);
        reply.is_whole = reply.body.len() as u64 == length;
        Ok(reply)
    }

    /// Whatever comes until the connection is closed.
    pub(crate) fn rest(&mut self) -> Vec<u8> {
        let mut rest = Vec::new();
        let _broken = self.stream.read_to_end(&mut rest);
        rest
    }

    pub(crate) fn ask(&mut self, method: &str, target: &str, headers: &[&str]) -> io::Result<Reply> {
        self.send(method, target, headers)?;
        self.receive(method)
    }

    fn line(&mut self) -> io::Result<String> {
        let mut line = String::new();
        self.stream.read_line(&mut line)?;
        Ok(line.trim_end().to_owned())
    }
}

/// One request on a connection of its own.
pub(crate) fn ask(address: SocketAddr, method: &str, target: &str, headers: &[&str]) -> Reply {
    Client::connect(address).ask(method, target, headers).unwrap()
}

pub(crate) fn get(address: SocketAddr, target: &str, headers: &[&str]) -> Reply {
    ask(address, "GET", target, headers)
}
