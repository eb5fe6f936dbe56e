//! The host's memory that is free for this process: what the system has, or less where control groups limit the process,
//! as a cluster's scheduler and containers do. A process that exceeds its group's limit is killed, however much the
//! system has. Files and their meaning are those of Linux (its documentation, admin-guide/cgroup-v2.rst and
//! cgroup-v1/memory.rst); elsewhere there are none, and no group limits anything.

use std::fs;
use std::path::{Component, Path, PathBuf};

/// Bytes that this process can still take.
pub(super) fn free() -> u64 {
    let mut system = sysinfo::System::new();
    system.refresh_memory();
    let memberships = fs::read_to_string("/proc/self/cgroup").unwrap_or_default();
    let left = left_by_groups(Path::new("/sys/fs/cgroup"), &memberships);
    left.unwrap_or(u64::MAX).min(system.available_memory())
}

/// Where the kernel states a group's limit, what it uses, and, in `memory.stat`, how much of that is files' pages that make
/// room for others.
struct Files {
    limit: &'static str,
    usage: &'static str,
    reclaimable: &'static str,
}

const VERSION_1: Files = Files {
    limit: "memory.limit_in_bytes",
    usage: "memory.usage_in_bytes",
    reclaimable: "total_inactive_file",
};
const VERSION_2: Files = Files {
    limit: "memory.max",
    usage: "memory.current",
    reclaimable: "inactive_file",
};

/// The bytes that the groups of `memberships`, which are lines of `/proc/self/cgroup`, and the groups around them leave at
/// least; `None` if none of them has a limit. `root` is where groups are mounted.
fn left_by_groups(root: &Path, memberships: &str) -> Option<u64> {
    let left = memberships.lines().flat_map(|line| {
        let mut fields = line.splitn(3, ':').skip(1);
        let (controllers, group) = (fields.next()?, fields.next()?);
        let (mount, files) = match controllers {
            "" => (root.to_path_buf(), VERSION_2),
            _ if controllers.split(',').any(|name| name == "memory") => {
                (root.join("memory"), VERSION_1)
            }
            _ => return None,
        };
        let folder = mount.join(inner(group));
        let around = folder
            .ancestors()
            .take_while(|folder| folder.starts_with(&mount));
        around.filter_map(|folder| files.left(folder)).min()
    });
    left.min()
}

/// A group's path below the mount. A group outside of what a container sees begins with `..`, and is that of the mount.
fn inner(group: &str) -> PathBuf {
    let components = Path::new(group).components();
    components
        .filter(|component| matches!(component, Component::Normal(_)))
        .collect()
}

impl Files {
    /// The bytes that the group of this folder leaves; `None` if it has no limit.
    fn left(&self, folder: &Path) -> Option<u64> {
        let number = |name| -> Option<u64> {
            let text = fs::read_to_string(folder.join(name)).ok()?;
            text.trim().parse().ok()
        };
        let (limit, usage) = (number(self.limit)?, number(self.usage)?);
        let statistics = fs::read_to_string(folder.join("memory.stat")).unwrap_or_default();
        let reclaimable = statistics.lines().find_map(|line| {
            let (name, bytes) = line.split_once(' ')?;
            (name == self.reclaimable).then(|| bytes.parse::<u64>().ok())?
        });
        Some(limit.saturating_sub(usage.saturating_sub(reclaimable.unwrap_or(0))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn group(folder: &Path, files: &Files, limit: &str, usage: u64, reclaimable: u64) {
        fs::create_dir_all(folder).unwrap();
        fs::write(folder.join(files.limit), format!("{limit}\n")).unwrap();
        fs::write(folder.join(files.usage), format!("{usage}\n")).unwrap();
        let statistics = format!("anon 7\n{} {reclaimable}\n", files.reclaimable);
        fs::write(folder.join("memory.stat"), statistics).unwrap();
    }

    #[test]
    fn the_tightest_group_decides() {
        let root = tempfile::tempdir().unwrap();
        let (job, step) = (
            root.path().join("slurm/job_7"),
            root.path().join("slurm/job_7/step_0"),
        );
        assert_eq!(
            left_by_groups(root.path(), "0::/slurm/job_7/step_0\n"),
            None
        );
        group(&step, &VERSION_2, "max", 500, 0);
        assert_eq!(
            left_by_groups(root.path(), "0::/slurm/job_7/step_0\n"),
            None
        );
        group(&job, &VERSION_2, "4000", 1500, 300);
        assert_eq!(
            left_by_groups(root.path(), "0::/slurm/job_7/step_0\n"),
            Some(2800)
        );
        group(&step, &VERSION_2, "600", 500, 0);
        assert_eq!(
            left_by_groups(root.path(), "0::/slurm/job_7/step_0\n"),
            Some(100)
        );
        assert_eq!(left_by_groups(root.path(), "0::/\n"), None);
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
            Some(9_223_372_036_854_762_712)
        );
        // A container sees its own group at the mount.
        group(&memory, &VERSION_1, "8000", 9000, 3000);
        assert_eq!(left_by_groups(root.path(), lines), Some(2000));
        group(root.path(), &VERSION_2, "1000", 1500, 0);
        assert_eq!(left_by_groups(root.path(), lines), Some(0));
        assert_eq!(left_by_groups(root.path(), "0::/../other\n"), Some(0));
        assert_eq!(left_by_groups(root.path(), "0"), None);
    }
}
