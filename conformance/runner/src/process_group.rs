//! The process group of a decoder: it is limited and killed as a whole.

use crate::limits::Limits;
use std::io;
use std::process::{Child, Command, ExitStatus};

/// A running decoder. It is killed when this is dropped.
#[derive(Debug)]
pub(crate) struct ProcessGroup {
    child: Child,
    reaped: bool,
}

impl ProcessGroup {
    /// Starts a command in a process group of its own.
    pub(crate) fn start(command: &mut Command, limits: &Limits) -> io::Result<Self> {
        system::separate(command);
        let group = Self { child: command.spawn()?, reaped: false };
        system::limit(&group.child, limits);
        Ok(group)
    }

    /// The first process.
    pub(crate) fn child(&mut self) -> &mut Child {
        &mut self.child
    }

    /// Whether the first process has ended. It is not reaped yet, so that its identifier stays that of the group.
    pub(crate) fn has_ended(&mut self) -> io::Result<bool> {
        system::has_ended(&mut self.child)
    }

    /// Bytes of resident memory of the first process and its descendants; 0 where the system does not report it.
    pub(crate) fn memory(&self) -> u64 {
        system::memory(self.child.id())
    }

    /// Kills what still runs; returns how the first process ended.
    pub(crate) fn end(&mut self) -> io::Result<ExitStatus> {
        if !self.reaped {
            system::kill(&mut self.child);
            self.reaped = true;
        }
        self.child.wait()
    }
}

impl Drop for ProcessGroup {
    fn drop(&mut self) {
        let _ended = self.end();
    }
}

#[cfg(unix)]
mod system {
    use crate::limits::Limits;
    use rustix::process::{Pid, Signal, WaitId, WaitIdOptions, kill_process_group, waitid};
    use std::io;
    use std::os::unix::process::CommandExt;
    use std::process::{Child, Command};

    pub(super) fn separate(command: &mut Command) {
        command.process_group(0);
    }

    pub(super) fn has_ended(child: &mut Child) -> io::Result<bool> {
        let options = WaitIdOptions::EXITED | WaitIdOptions::NOHANG | WaitIdOptions::NOWAIT;
        Ok(waitid(WaitId::Pid(Pid::from_child(child)), options)?.is_some())
    }

    /// It is no error if the group has ended already.
    pub(super) fn kill(child: &mut Child) {
        let _gone = kill_process_group(Pid::from_child(child), Signal::KILL);
    }

    /// It is no error if the decoder has ended before its limits are set.
    #[cfg(target_os = "linux")]
    pub(super) fn limit(child: &Child, limits: &Limits) {
        use rustix::process::{Resource, Rlimit, prlimit};
        let at_most = |bytes: u64| Rlimit { current: Some(bytes), maximum: Some(bytes) };
        let pid = Some(Pid::from_child(child));
        let _gone = prlimit(pid, Resource::Data, at_most(limits.memory.saturating_mul(2)));
        let _gone = prlimit(pid, Resource::Fsize, at_most(limits.output));
        let _gone = prlimit(pid, Resource::Core, at_most(0));
    }

    #[cfg(not(target_os = "linux"))]
    pub(super) fn limit(_: &Child, _: &Limits) {}

    #[cfg(target_os = "linux")]
    pub(super) fn memory(process: u32) -> u64 {
        let read = |path: String| std::fs::read_to_string(path).unwrap_or_default();
        let statm = read(format!("/proc/{process}/statm"));
        let pages: u64 = statm.split(' ').nth(1).and_then(|pages| pages.parse().ok()).unwrap_or(0);
        let page = u64::try_from(rustix::param::page_size()).unwrap_or(4096);
        let children = read(format!("/proc/{process}/task/{process}/children"));
        let below: u64 = children.split_whitespace().filter_map(|child| child.parse().ok()).map(memory).sum();
        pages.saturating_mul(page).saturating_add(below)
    }

    #[cfg(not(target_os = "linux"))]
    pub(super) fn memory(_: u32) -> u64 {
        0
    }
}

#[cfg(not(unix))]
mod system {
    use crate::limits::Limits;
    use std::io;
    use std::process::{Child, Command};

    pub(super) fn separate(_: &mut Command) {}

    pub(super) fn has_ended(child: &mut Child) -> io::Result<bool> {
        Ok(child.try_wait()?.is_some())
    }

    pub(super) fn kill(child: &mut Child) {
        let _gone = child.kill();
    }

    pub(super) fn limit(_: &Child, _: &Limits) {}

    pub(super) fn memory(_: u32) -> u64 {
        0
    }
}
