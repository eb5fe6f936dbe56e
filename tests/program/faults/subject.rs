//! What is run with one fault after the other, and what must come of it.

use std::collections::BTreeMap;
use std::os::unix::process::ExitStatusExt;

use crate::Folder;
use crate::faulty::{Call, Ended, Fault, run};

/// The outcome of a call that came in a sound run and not in this one: how many there are depends on the time as well.
const MISSED: &str = "did not come";

/// How a run with a fault has ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Outcome {
    /// As if nothing had failed.
    Success,
    /// With all outputs, and a note that says what has failed.
    Note,
    /// With this exit status and a sentence.
    Refusal(i32),
    Death,
}

/// What is run, and what must come of it.
pub struct Subject {
    /// Makes a folder with all that the command reads.
    pub folder: fn() -> Folder,
    pub arguments: &'static str,
    /// What it writes. Those that end in .json hold times, and differ from run to run.
    pub outputs: &'static [&'static str],
    /// What may be there as well, to go on with.
    pub kept: &'static [&'static str],
    /// Kinds of calls that are to fail and that it does not make: a fault without a place tries nothing.
    pub never: &'static [&'static str],
}

/// A run without a fault.
pub struct Sound {
    pub ended: Ended,
    outputs: Vec<Vec<u8>>,
    before: Vec<String>,
}

impl Subject {
    /// Whatever it may write.
    fn files(&self) -> Vec<String> {
        [self.outputs, self.kept]
            .concat()
            .iter()
            .map(ToString::to_string)
            .collect()
    }

    pub fn sound(&self) -> Sound {
        let folder = (self.folder)();
        let before = folder.names();
        let ended = run(&folder, self.arguments, None);
        assert!(ended.status.success(), "{}: {ended:?}", self.arguments);
        let outputs = self.outputs.iter().map(|name| folder.read(name)).collect();
        Sound {
            ended,
            outputs,
            before,
        }
    }

    /// Runs with a fault, and once more without it. `None` if the call did not come.
    fn outcome(&self, sound: &Sound, fault: &Fault) -> Option<(Call, Outcome)> {
        let folder = (self.folder)();
        let ended = run(&folder, self.arguments, Some(fault));
        let failed = ended.failed().next()?.clone();
        let about = format!("{}: {fault} ({})", self.arguments, failed.name);
        let outcome = judge(&ended, &about);
        assert_eq!(outcome == Outcome::Death, fault.how == "kill", "{about}");
        if let Outcome::Refusal(3) = outcome {
            let files = [&sound.before[..], &self.files()].concat();
            let is_named = files.iter().any(|file| ended.stderr.contains(file));
            assert!(is_named, "{about}: {}", ended.stderr);
        }
        for name in folder.names() {
            let is_ours = self.files().contains(&name);
            let is_temporary = name.starts_with('.') || name.ends_with(".lock");
            let may_stay = outcome == Outcome::Death || ["remove", "lock"].contains(&&*fault.kind);
            assert!(
                sound.before.contains(&name) || is_ours || is_temporary && may_stay,
                "{about}: left {name}: {}",
                ended.stderr
            );
        }
        let is_done = matches!(outcome, Outcome::Success | Outcome::Note);
        self.check_outputs(&folder, sound, is_done, &about);
        if is_done {
            // A folder's volume goes without a file that is damaged, and says so; not without one that the system keeps back.
            let tells =
                fault.how != super::EIO && ended.stderr.contains("file that cannot be read");
            assert!(
                tells || ended.stdout == sound.ended.stdout,
                "{about}: {ended:?}"
            );
        }
        let is_input_whole = !["shrink", "change"].contains(&&*fault.how);
        let is_untouched = self.kept.is_empty() && folder.names() == sound.before;
        if is_input_whole && !is_untouched {
            let about = format!("{about}, and once more without it");
            let again = run(&folder, self.arguments, None);
            assert!(again.status.success(), "{about}: {again:?}");
            self.check_outputs(&folder, sound, true, &about);
            let left = folder
                .names()
                .into_iter()
                .find(|name| name.starts_with('.'));
            assert_eq!(left, None, "{about}");
        }
        Some((failed, outcome))
    }

    /// The outputs are whole, or absent unless all of them are `needed`.
    pub fn check_outputs(&self, folder: &Folder, sound: &Sound, needed: bool, about: &str) {
        for (name, expected) in self.outputs.iter().zip(&sound.outputs) {
            if !needed && !folder.path(name).exists() {
                continue;
            }
            let is_whole = if name.ends_with(".json") {
                serde_json::from_slice::<serde_json::Value>(&folder.read(name)).is_ok()
            } else {
                folder.read(name) == *expected
            };
            assert!(is_whole, "{about}: {name} is not what it should be");
        }
    }

    /// Tries each fault at its places, and returns how often what came of it.
    pub fn try_all(&self, faults: &[Tried]) -> Tally {
        let sound = self.sound();
        let without_place = faults
            .iter()
            .filter(|tried| tried.places(&sound.ended.calls).is_empty());
        let mut never: Vec<&str> = without_place.map(|tried| &*tried.kind).collect();
        never.dedup();
        assert_eq!(
            never, self.never,
            "{}: calls without a place",
            self.arguments
        );
        let mut tally = Tally::default();
        for tried in faults {
            for number in tried.places(&sound.ended.calls) {
                let fault = Fault {
                    kind: tried.kind.to_string(),
                    number,
                    how: tried.how.to_string(),
                    lasts: tried.lasts,
                };
                let Some((call, outcome)) = self.outcome(&sound, &fault) else {
                    tally.add(tried, MISSED);
                    continue;
                };
                assert!(
                    (tried.allows)(&call, outcome),
                    "{}: {fault} ({}): {outcome:?}",
                    self.arguments,
                    call.name
                );
                tally.add(tried, &format!("{outcome:?}"));
            }
        }
        let missed = tally.0.iter().filter(|((_, outcome), _)| outcome == MISSED);
        let missed: usize = missed.map(|(_, count)| count).sum();
        assert!(missed * 10 <= tally.places(), "{missed} calls did not come");
        tally
    }
}

/// What a run says and how it ends fit each other.
#[track_caller]
pub fn judge(ended: &Ended, about: &str) -> Outcome {
    let said = &ended.stderr;
    for bad in ["panicked", "Vulkan validation", "SIGSEGV"] {
        assert!(!said.contains(bad), "{about}: {said}");
    }
    let sentences: Vec<&str> = said
        .lines()
        .filter(|line| line.starts_with("isolume: "))
        .collect();
    match ended.status.code() {
        None => {
            assert_eq!(sentences, [""; 0], "{about}");
            // Only a test's own kill ends it so: a crash has another signal.
            const SIGKILL: i32 = 9;
            assert_eq!(ended.status.signal(), Some(SIGKILL), "{about}: {ended:?}");
            Outcome::Death
        }
        Some(0) => {
            assert_eq!(sentences, [""; 0], "{about}");
            if said.lines().any(|line| line.starts_with("note: ")) {
                Outcome::Note
            } else {
                Outcome::Success
            }
        }
        Some(status) => {
            assert_eq!(sentences.len(), 1, "{about}: {said}");
            assert_eq!(said.lines().last(), sentences.last().copied(), "{about}");
            Outcome::Refusal(status)
        }
    }
}

/// A fault, and how many places of it.
pub struct Tried {
    pub kind: String,
    pub how: &'static str,
    pub lasts: bool,
    /// Of the suite's spread.
    pub most: usize,
    pub allows: fn(&Call, Outcome) -> bool,
}

impl Tried {
    /// Numbers of calls of this kind.
    fn places(&self, calls: &[Call]) -> Vec<usize> {
        let is_any = self.kind == "any";
        let all = calls.iter().filter(|c| is_any || c.kind == self.kind);
        let count = all.count();
        let asked = std::env::var("ISOLUME_FAULTS").ok();
        let wanted = match asked.as_deref() {
            Some("all") => count,
            Some(number) => number.parse().expect("a number of places, or all"),
            None => self.most,
        };
        let wanted = wanted.min(count);
        (0..wanted)
            .map(|i| (2 * i + 1) * count / (2 * wanted))
            .collect()
    }
}

/// Places by fault and outcome.
#[derive(Default)]
pub struct Tally(BTreeMap<(String, String), usize>);

impl Tally {
    fn add(&mut self, tried: &Tried, outcome: &str) {
        let lasts = if tried.lasts { " and later ones" } else { "" };
        let fault = format!("{} {}{lasts}", tried.kind, tried.how);
        *self.0.entry((fault, outcome.to_string())).or_default() += 1;
    }

    fn places(&self) -> usize {
        self.0.values().sum()
    }

    pub fn print(&self, name: &str) {
        println!("{name}:");
        for ((fault, outcome), count) in &self.0 {
            println!("  {fault:44} {outcome:14} {count}");
        }
        println!("  {} places in all", self.places());
    }
}

/// One place after the other, `most` of them in the suite.
pub fn tried(
    kind: &str,
    how: &'static str,
    most: usize,
    allows: fn(&Call, Outcome) -> bool,
) -> Tried {
    Tried {
        kind: kind.to_string(),
        how,
        lasts: false,
        most,
        allows,
    }
}
