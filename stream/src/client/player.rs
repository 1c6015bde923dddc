//! The loop of a playback: a player decides, requests run beside it, GOPs are shown.

use super::clock::Clock;
use super::download::{Download, Event};
use super::report::{Outcome, Screen};
use super::{Client, ClientError, Options, read_manifest};
use crate::control::{Fetch, Playback, Rule};
use crate::playback::{Command, GopLog, Options as Playing, Player};
use crate::simulation::Report;
use std::time::Duration;

impl Client {
    /// Plays all of the presentation under a rule.
    ///
    /// # Errors
    /// A package that becomes another one, and one whose GOPs are too large.
    pub fn play<R: Rule>(&mut self, rule: R, screen: &mut dyn Screen) -> Result<Outcome, ClientError> {
        let clock = Clock::new(self.options.real_time);
        let player = Player::new(self.manifest.clone(), playing(&self.options), rule, clock.now_us())?;
        let mut run = Run { client: self, player, clock, download: None, fetches: Vec::new() };
        while run.player.state().playback() != Playback::Ended {
            let wake_us = run.decide()?;
            run.present(screen);
            run.step(wake_us);
        }
        run.present(screen);
        Ok(run.outcome())
    }
}

fn playing(options: &Options) -> Playing {
    let Options { attempts, base_attempts, memory, .. } = *options;
    Playing { settings: options.settings.clone(), attempts, base_attempts, memory }
}

struct Run<'a, R> {
    client: &'a mut Client,
    player: Player<R>,
    clock: Clock,
    download: Option<Download>,
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
                Command::Wait { until_us } => return Ok(until_us),
            }
        }
    }

    /// Reads the manifest again.
    fn read_again(&mut self) -> Result<(), ClientError> {
        let manifest = read_manifest(&self.client.source, &self.client.options)?;
        self.client.source.forget();
        self.player.renew(self.clock.now_us(), manifest)?;
        self.client.manifest.clone_from(self.player.manifest());
        Ok(())
    }

    /// Waits for the next event, and takes it.
    fn step(&mut self, until_us: u64) {
        let Some(download) = &self.download else { return self.clock.wait_until(until_us) };
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
        let report = Report {
            shown: state.shown().to_vec(),
            complete: state.shown().len() == state.ladder().gops().len(),
            waiting_us: state.waiting_us(),
            ended_us: state.now_us(),
            bytes: sum(|log| log.bytes),
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
