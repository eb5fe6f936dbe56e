//! The host's memory that is free for this process: what the system has, or less where control groups limit the process,
//! as a cluster's scheduler and containers do, or where its address space is limited, as by `ulimit -v` and by other
//! schedulers. A process that exceeds its group's limit is killed, however much the system has. Files and their meaning
//! are those of Linux (its documentation, admin-guide/cgroup-v2.rst and cgroup-v1/memory.rst, and proc(5)); elsewhere
//! there are none, and nothing limits anything.

use std::fs;
use std::path::{Component, Path, PathBuf};

use crate::error::MemoryError;

/// Bytes that this process can still take.
pub(super) fn free() -> u64 {
    let mut system = sysinfo::System::new();
    system.refresh_memory();
    let memberships = fs::read_to_string("/proc/self/cgroup").unwrap_or_default();
    let left = [
        left_by_groups(Path::new("/sys/fs/cgroup"), &memberships),
        left_of_addresses(),
    ];
    let left = left.into_iter().flatten().min();
    left.unwrap_or(u64::MAX).min(system.available_memory())
}

/// The bytes of addresses that this process can still take; `None` if they are not limited.
#[cfg(unix)]
fn left_of_addresses() -> Option<u64> {
    use rustix::process::{Resource, getrlimit};
    let limit = getrlimit(Resource::As).current?;
    let pages = fs::read_to_string("/proc/self/statm").ok()?;
    let pages: u64 = pages.split(' ').next()?.parse().ok()?;
    let taken = pages.saturating_mul(rustix::param::page_size() as u64);
    Some(limit.saturating_sub(taken))
}

#[cfg(not(unix))]
fn left_of_addresses() -> Option<u64> {
    None
}

/// Fails where `free` bytes, of which so many are planned for something else, are too few for a picture of this size, which
/// takes `bytes`.
pub(super) fn check_picture(
    size: [u32; 2],
    bytes: u64,
    free: u64,
    planned: u64,
) -> Result<(), MemoryError> {
    if bytes <= free.saturating_sub(planned) {
        return Ok(());
    }
    Err(MemoryError::Picture {
        size,
        bytes,
        free,
        planned,
    })
}

/// Where the kernel states a group's limits, what it uses, and, in `memory.stat`, how much of that is files' pages, which make
/// room for others.
struct Files {
    /// Beyond one of these a process is killed, beyond another slowed down until it hardly runs.
    limits: &'static [&'static str],
    usage: &'static str,
    reclaimable: [&'static str; 2],
}

const VERSION_1: Files = Files {
    limits: &["memory.limit_in_bytes"],
    usage: "memory.usage_in_bytes",
    reclaimable: ["total_inactive_file", "total_active_file"],
};
const VERSION_2: Files = Files {
    limits: &["memory.max", "memory.high"],
    usage: "memory.current",
    reclaimable: ["inactive_file", "active_file"],
};

/// The bytes that the groups of `memberships`, which are lines of `/proc/self/cgroup`, and the groups around them leave at
/// least; `None` if none of them has a limit. `root` is where groups are mounted.
fn left_by_groups(root: &Path, memberships: &str) -> Option<u64> {
    let left = memberships.lines().flat_map(|line| {
        let mut fields = line.splitn(3, ':').skip(1);
        let (controllers, group) = (fields.next()?, fields.next()?);
        let (mounts, files) = match controllers {
            // Beside version 1, version 2 has a folder of its own.
            "" => (vec![root.to_path_buf(), root.join("unified")], VERSION_2),
            _ if controllers.split(',').any(|name| name == "memory") => {
                (vec![root.join("memory")], VERSION_1)
            }
            _ => return None,
        };
        let left = mounts
            .iter()
            .filter_map(|mount| files.least_left(mount, group));
        left.min()
    });
    left.min()
}

/// A group's path below the mount. A group outside of what a container sees has `..` in it, and is seen as the mount.
fn inner(group: &str) -> PathBuf {
    let group = Path::new(group.trim_start_matches('/'));
    let is_seen = group
        .components()
        .all(|component| matches!(component, Component::Normal(_)));
    if is_seen {
        group.to_path_buf()
    } else {
        PathBuf::new()
    }
}

impl Files {
    /// The least that this group of the mount and those around it leave; `None` if none of them has a limit.
    fn least_left(&self, mount: &Path, group: &str) -> Option<u64> {
        let folder = mount.join(inner(group));
        let around = folder
            .ancestors()
            .take_while(|folder| folder.starts_with(mount));
        around.filter_map(|folder| self.left(folder)).min()
    }

    /// The bytes that the group of this folder leaves; `None` if it has no limit.
    fn left(&self, folder: &Path) -> Option<u64> {
        let number = |name: &&str| -> Option<u64> {
            let text = fs::read_to_string(folder.join(name)).ok()?;
            text.trim().parse().ok()
        };
        let limit = self.limits.iter().filter_map(number).min()?;
        let statistics = fs::read_to_string(folder.join("memory.stat")).unwrap_or_default();
        let pages = statistics.lines().filter_map(|line| {
            let (name, bytes) = line.split_once(' ')?;
            let bytes = bytes.parse::<u64>().ok()?;
            self.reclaimable.contains(&name).then_some(bytes)
        });
        let usage = number(&self.usage).unwrap_or(0);
        Some(limit.saturating_sub(usage.saturating_sub(pages.sum())))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn group(folder: &Path, files: &Files, limit: &str, usage: u64, reclaimable: u64) {
        fs::create_dir_all(folder).unwrap();
        fs::write(folder.join(files.limits[0]), format!("{limit}\n")).unwrap();
        fs::write(folder.join(files.usage), format!("{usage}\n")).unwrap();
        let [inactive, active] = files.reclaimable;
        let statistics = format!("anon 7\n{inactive} {reclaimable}\n{active} 100\n");
        fs::write(folder.join("memory.stat"), statistics).unwrap();
    }

    #[test]
    fn the_tightest_group_decides() {
        let root = tempfile::tempdir().unwrap();
        let (job, step) = (
            root.path().join("slurm/job_7"),
            root.path().join("slurm/job_7/step_0"),
        );
        let left = || left_by_groups(root.path(), "0::/slurm/job_7/step_0\n");
        assert_eq!(left(), None);
        group(&step, &VERSION_2, "max", 500, 0);
        assert_eq!(left(), None);
        group(&job, &VERSION_2, "4000", 1500, 300);
        assert_eq!(left(), Some(2900));
        group(&step, &VERSION_2, "600", 500, 0);
        assert_eq!(left(), Some(200));
        fs::write(job.join("memory.high"), "1600\n").unwrap();
        fs::remove_file(step.join("memory.max")).unwrap();
        assert_eq!(left(), Some(500));
        assert_eq!(left_by_groups(root.path(), "0::/\n"), None);
    }

    #[test]
    fn a_picture_that_the_host_has_no_room_for_is_refused() {
        let check = |free, planned| check_picture([20_000, 10_000], 16 << 30, free, planned);
        assert_eq!(check(16 << 30, 0), Ok(()));
        assert_eq!(check(17 << 30, 1 << 30), Ok(()));
        assert!(check(17 << 30, 2 << 30).is_err());
        assert!(check(1, 2).is_err());
        let refusal = check(15 << 30, 0).unwrap_err();
        assert_eq!(
            refusal.to_string(),
            "a picture of 20000x10000 pixels needs about 16.0 GiB of the host's memory, and 15.0 GiB are free"
        );
    }

    #[test]
    fn both_versions_of_groups_are_read() {
        let root = tempfile::tempdir().unwrap();
        let lines = "5:devices:/\n4:cpu,memory:/docker/a\n1:name=systemd:/\n0::/\n";
        // What an unlimited group of version 1 says.
        let memory = root.path().join("memory");
        group(&memory, &VERSION_1, "9223372036854771712", 9000, 0);
        assert_eq!(
            left_by_groups(root.path(), lines),
            Some(9_223_372_036_854_762_812)
        );
        // A container sees its own group at the mount.
        group(&memory, &VERSION_1, "8000", 9000, 3000);
        assert_eq!(left_by_groups(root.path(), lines), Some(2100));
        group(&root.path().join("unified"), &VERSION_2, "1000", 1100, 0);
        assert_eq!(left_by_groups(root.path(), lines), Some(0));
        group(root.path(), &VERSION_2, "1000", 1500, 0);
        assert_eq!(left_by_groups(root.path(), lines), Some(0));
        assert_eq!(left_by_groups(root.path(), "0::/../other\n"), Some(0));
        assert_eq!(left_by_groups(root.path(), "0"), None);
    }
}
