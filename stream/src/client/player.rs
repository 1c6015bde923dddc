//! The loop of a playback: a player decides, requests run beside it, GOPs are shown.

use super::clock::Clock;
use super::download::{Download, Event};
use super::poll::Poll;
use super::report::{Outcome, Screen};
use super::{Client, ClientError, Options, read_manifest};
use crate::control::{Fetch, Rule};
use crate::package::Package;
use crate::playback::{Command, GopLog, Options as Playing, PlaybackError, Player};
use crate::simulation::Report;
use std::time::Duration;

impl Client {
    /// Plays all of the presentation under a rule, and what comes meanwhile of one that grows, until that has ended.
    ///
    /// # Errors
    /// A package that becomes another one, and one whose GOPs are too large; a presentation that grows no more and has not
    /// ended.
    pub fn play<R: Rule>(&mut self, rule: R, screen: &mut dyn Screen) -> Result<Outcome, ClientError> {
        let clock = Clock::new(self.options.real_time);
        let player = Player::new(self.manifest.clone(), playing(&self.options), rule, clock.now_us())?;
        let mut run = Run { client: self, player, clock, download: None, poll: None, fetches: Vec::new() };
        while !run.player.has_ended() {
            let wake_us = run.decide()?;
            run.present(screen);
            run.step(wake_us);
            run.hear()?;
        }
        run.present(screen);
        run.client.manifest.clone_from(run.player.manifest());
        Ok(run.outcome())
    }
}

/// How often it is looked whether the manifest has come.
const LOOK_US: u64 = 5000;

fn playing(options: &Options) -> Playing {
    let Options { attempts, base_attempts, memory, following, .. } = *options;
    Playing { settings: options.settings.clone(), attempts, base_attempts, memory, following }
}

struct Run<'a, R> {
    client: &'a mut Client,
    player: Player<R>,
    clock: Clock,
    download: Option<Download>,
    poll: Option<Poll>,
    fetches: Vec<(u64, Fetch)>,
}

impl<R: Rule> Run<'_, R> {
    /// Does what the player wants until it waits; until when.
    fn decide(&mut self) -> Result<u64, ClientError> {
        loop {
            let now_us = self.clock.now_us();
            match self.player.decide(now_us) {
                Command::Fetch(requests) => {
                    self.download = Some(Download::start(self.client.source.clone(), requests));
                    self.fetches.extend(self.player.fetch().map(|fetch| (now_us, fetch.clone())));
                }
                Command::Abandon => self.download = None,
                Command::ReadManifest => self.read_again()?,
                Command::PollManifest => {
                    let Client { source, tag, options, .. } = &*self.client;
                    self.poll = Some(Poll::start(source.clone(), options.layers, tag.clone()));
                }
                Command::Wait { until_us } => return Ok(until_us),
            }
        }
    }

    /// Reads the manifest again.
    fn read_again(&mut self) -> Result<(), ClientError> {
        let (manifest, tag) = read_manifest(&self.client.source, &self.client.options)?;
        self.client.source.forget();
        self.client.tag = tag;
        self.player.renew(self.clock.now_us(), manifest)?;
        Ok(())
    }

    /// Takes the manifest that was being read, if that has come.
    fn hear(&mut self) -> Result<(), ClientError> {
        let Some(polled) = self.poll.as_ref().and_then(Poll::take) else { return Ok(()) };
        self.poll = None;
        let now_us = self.clock.now_us();
        match polled {
            Ok(Some((manifest, tag))) => {
                self.client.tag = tag;
                self.player.renew(now_us, manifest)?;
            }
            Ok(None) => self.player.unchanged(now_us)?,
            Err(fault) => self.player.unreadable(now_us).map_err(|error| match error {
                PlaybackError::Stopped(_) => {
                    ClientError::Unreachable(self.client.source.place(Package::MANIFEST), fault.to_string())
                }
                error => error.into(),
            })?,
        }
        Ok(())
    }

    /// Waits for the next event, and takes it.
    fn step(&mut self, until_us: u64) {
        let until_us = match self.poll {
            Some(_) => until_us.min(self.clock.now_us().saturating_add(LOOK_US)),
            None => until_us,
        };
        let Some(download) = &self.download else {
            return self.clock.wait_until(until_us, self.player.is_following());
        };
        let left_us = until_us.saturating_sub(self.clock.now_us()).max(1);
        let Some(event) = download.next(Duration::from_micros(left_us)) else { return };
        let now_us = self.clock.now_us();
        match event {
            Event::Sent => self.player.sent(),
            Event::Begun => self.player.begun(now_us),
            Event::Bytes(bytes) => self.player.received(now_us, &bytes),
            Event::Failed(fault) => self.player.failed(now_us, &fault),
        }
        if !self.player.is_fetching() {
            self.download = None;
        }
    }

    /// Hands the screen what has begun.
    fn present(&mut self, screen: &mut dyn Screen) {
        while let Some(gop) = self.player.show() {
            screen.show(&gop);
        }
    }

    fn outcome(self) -> Outcome {
        let logs = self.player.logs();
        let sum = |of: fn(&GopLog) -> u64| logs.iter().map(of).fold(0, u64::saturating_add);
        let state = self.player.state();
        // Those that were skipped are between.
        let spanned = logs.first().zip(logs.last());
        let spanned =
            spanned.map_or(0, |(first, last)| last.number.saturating_sub(first.number).saturating_add(1));
        let report = Report {
            shown: state.shown().to_vec(),
            complete: state.shown().len() == spanned,
            waiting_us: state.waiting_us(),
            ended_us: state.now_us(),
            bytes: sum(|log| log.bytes),
            media_bytes: state.media_bytes(),
            requests: sum(|log| log.requests),
            abandoned: sum(|log| log.abandoned),
            decisions: self.player.decisions(),
            fetches: self.fetches,
        };
        Outcome {
            report,
            gops: logs.to_vec(),
            losses: self.player.losses().to_vec(),
            ladder: state.ladder().clone(),
        }
    }
}
