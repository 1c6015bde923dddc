//! How much memory this machine still gives.
//!
//! A decoder that asks for more than there is would not fail: the system ends the process, or the allocator aborts it. So what
//! a stream may take is bounded by the least of three: what the kernel says is free, what the control groups of the process
//! leave (a container's limit), and what its address space may still grow by (`ulimit -v`). All three are figures of Linux;
//! elsewhere nothing is known, and nothing is bounded.

use std::path::{Path, PathBuf};

/// Bytes that may be taken, of what is there: the rest is for what a command holds besides, such as the file that it writes.
pub(crate) fn memory() -> u64 {
    let there = [free(), of_groups(), of_address_space()].into_iter().flatten().min();
    there.map_or(u64::MAX, |bytes| bytes - bytes / 4)
}

/// What programs can have without others being ended: free pages, what the kernel gives back, and free swap.
fn free() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/meminfo").ok()?;
    let kibibytes = |name| named(&text, name).map(|number| number << 10);
    Some(kibibytes("MemAvailable:")?.saturating_add(kibibytes("SwapFree:").unwrap_or(0)))
}

/// What the control groups of this process leave, the narrowest of them from its own to the root; version 2 or 1.
fn of_groups() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/self/cgroup").ok()?;
    text.lines().filter_map(groups).min()
}

/// What the groups of a line of `/proc/self/cgroup` leave: its fields are a number, controllers and a path.
fn groups(line: &str) -> Option<u64> {
    let mut fields = line.splitn(3, ':').skip(1);
    let (controllers, path) = (fields.next()?, fields.next()?);
    let (root, names) = match controllers {
        "" => ("/sys/fs/cgroup", ["memory.max", "memory.current", "file"]),
        _ if controllers.split(',').any(|name| name == "memory") => {
            ("/sys/fs/cgroup/memory", ["memory.limit_in_bytes", "memory.usage_in_bytes", "total_cache"])
        }
        _ => return None,
    };
    let own: PathBuf = Path::new(root).join(path.trim_start_matches('/'));
    own.ancestors().take_while(|group| group.starts_with(root)).filter_map(|group| left(group, names)).min()
}

/// What a group leaves: its limit, less what it holds that is no copy of a file. None without a limit.
fn left(group: &Path, [limit, used, files]: [&str; 3]) -> Option<u64> {
    let read = |name: &str| std::fs::read_to_string(group.join(name)).ok();
    let number = |name| read(name)?.trim().parse::<u64>().ok();
    let copies = read("memory.stat").and_then(|text| named(&text, files)).unwrap_or(0);
    Some(number(limit)?.saturating_sub(number(used)?.saturating_sub(copies)))
}

/// What the thread for signals takes of the address space, which is not started yet: its stack, and what the allocator sets aside
/// for it. In both is little.
#[cfg(target_os = "linux")]
const OF_THREAD: u64 = 66 << 20;

/// What the address space may still grow by; none if it has no limit.
#[cfg(target_os = "linux")]
fn of_address_space() -> Option<u64> {
    use rustix::process::{Resource, getrlimit};
    let limit = getrlimit(Resource::As).current?;
    // What the allocator sets aside for each thread is taken with the first that it asks for, and counts before what is left.
    rayon::broadcast(|_| drop(std::hint::black_box(Box::new(0_u8))));
    let pages: u64 = std::fs::read_to_string("/proc/self/statm").ok()?.split(' ').next()?.parse().ok()?;
    let taken = pages.saturating_mul(rustix::param::page_size() as u64);
    Some(limit.saturating_sub(taken).saturating_sub(OF_THREAD))
}

#[cfg(not(target_os = "linux"))]
const fn of_address_space() -> Option<u64> {
    None
}

/// The number that follows a name at the start of a line.
fn named(text: &str, name: &str) -> Option<u64> {
    let mut words =
        text.lines().map(str::split_whitespace).find(|words| words.clone().next() == Some(name))?;
    words.nth(1)?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_group_leaves_what_it_does_not_hold_and_copies_of_files() {
        let group = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| std::fs::write(group.path().join(name), text).unwrap();
        let names = ["memory.max", "memory.current", "file"];
        write("memory.current", "700\n");
        write("memory.max", "max\n");
        assert_eq!(left(group.path(), names), None);
        write("memory.max", "1000\n");
        assert_eq!(left(group.path(), names), Some(300));
        write("memory.stat", "anon 500\nfile 200\nfile_mapped 7\n");
        assert_eq!(left(group.path(), names), Some(500));
    }

    #[test]
    fn lines_of_other_controllers_say_nothing() {
        assert_eq!(groups("4:cpu,cpuacct:/a"), None);
        assert_eq!(groups("nothing"), None);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn something_is_free() {
        assert!(free().unwrap() > 1 << 20);
        assert!(memory() > 1 << 20);
    }
}
