//! A render that was killed goes on from its checkpoint and ends with the bytes of one that was not.

use std::process::Command;
use std::thread::sleep;
use std::time::{Duration, Instant, SystemTime};

use rustix::process::Signal;

use crate::number::number;
use crate::refusals::refused;
use crate::stopping::{PATIENCE, ends, send, started, wait_until};
use crate::{Folder, ended, last_line, text};

/// What each variant renders: for a few seconds, on a CPU.
const UNCACHED: &str = "render ball.toml --variant non-caching --size 96x64 --spp 1024";
const CACHED: &str = "render ball.toml --variant caching --cache-scale 0.5 --size 96x64 --spp 512";
pub const OFTEN: &str = "--checkpoint c.exr --checkpoint-every 0.02";

/// Kills a render again and again, at some moment after it has begun to write, until it gets to its end. Returns how
/// often it was killed. `ISOLUME_KILLS=50` kills more often, and later.
pub fn survive(folder: &Folder, command: &str, random: &mut fastrand::Rng) -> u32 {
    let kills = std::env::var("ISOLUME_KILLS");
    let most: u32 = kills.map_or(2, |n| n.parse().expect("ISOLUME_KILLS: a number"));
    for kill in 0..most {
        let before = changed(folder);
        let mut process = folder.isolume(command).spawn().expect("it starts");
        let began = Instant::now();
        while changed(folder) == before {
            assert!(began.elapsed() < PATIENCE, "nothing is written");
            if process.try_wait().expect("a process").is_some() {
                return kill;
            }
            sleep(Duration::from_millis(1));
        }
        sleep(Duration::from_millis(random.u64(0..120)));
        process.kill().expect("it is killed");
        process.wait().expect("it has ended");
    }
    folder.succeed(command);
    most
}

/// When the checkpoint was written last: the picture, and the cache.
fn changed(folder: &Folder) -> [Option<std::time::SystemTime>; 2] {
    ["c.exr", "c.exr.cache"].map(|name| {
        let about = std::fs::metadata(folder.path(name)).ok();
        about.and_then(|about| about.modified().ok())
    })
}

/// How many units of the picture and batches of a coarse lattice of the cache a run has worked off itself.
fn work(folder: &Folder, stats: &str) -> u64 {
    let stats = folder.json(stats);
    let passes = stats["passes"].as_array().expect("passes").iter();
    let counted =
        passes.filter(|pass| pass["name"] == "accumulate" || pass["name"] == "spread_light");
    counted
        .map(|pass| pass["runs"].as_u64().expect("a count"))
        .sum()
}

#[test]
fn a_render_that_was_killed_ends_with_the_same_bytes() {
    let folder = Folder::new();
    let mut random = fastrand::Rng::with_seed(21);
    for render in [UNCACHED, CACHED] {
        folder.succeed(&format!("{render} -o whole.exr --stats whole.json"));
        for name in ["c.exr", "c.exr.cache"] {
            let _ = std::fs::remove_file(folder.path(name));
        }
        let kills = survive(
            &folder,
            &format!("{render} -o again.exr --stats again.json {OFTEN} --quiet"),
            &mut random,
        );
        println!("{render}: killed {kills} times");
        assert!(kills > 0);
        assert!(
            folder.read("again.exr") == folder.read("whole.exr"),
            "{render}"
        );
        let [again, whole] = ["again.json", "whole.json"].map(|name| work(&folder, name));
        assert!(again < whole, "{render}: {again} of {whole}");
    }
}

/// With the same variant, even if that is left open.
#[test]
fn an_orbit_goes_on_where_it_was() {
    orbit_that_was_killed("--variant caching --cache-scale 0.5");
    orbit_that_was_killed("--variant auto");
}

fn orbit_that_was_killed(variant: &str) {
    let folder = Folder::new();
    let orbit = format!("render ball.toml {variant} --size 96x64 --spp 64 --orbit 3");
    let whole = folder.succeed(&format!("{orbit} -o whole.exr --stats whole.json"));
    let mut child = started(&folder, &format!("{orbit} -o turn.exr {OFTEN}"));
    let second = folder.path("turn.0002.exr");
    wait_until(&mut child, "a second picture", || second.exists());
    child.process.kill().expect("it is killed");
    child.process.wait().expect("it has ended");
    assert!(!folder.path("turn.0003.exr").exists(), "it was too fast");
    let modified = |name| std::fs::metadata(folder.path(name)).and_then(|about| about.modified());
    let first = modified("turn.0001.exr").expect("a time");
    let rest = folder.succeed(&format!("{orbit} -o turn.exr {OFTEN}"));
    let why = |output| last_line(output).split("; ").nth(1).map(String::from);
    assert_eq!(why(&rest), why(&whole), "the variant and its reason");
    for number in 1..=3 {
        let [turn, whole] = ["turn", "whole"].map(|name| format!("{name}.000{number}.exr"));
        assert!(folder.read(&turn) == folder.read(&whole), "{turn}");
    }
    let still = modified("turn.0001.exr").expect("a time");
    assert_eq!(first, still, "the first picture was rendered again");

    // One that is missing, and one that is another render's.
    std::fs::remove_file(folder.path("turn.0001.exr")).expect("it was there");
    folder.write("turn.0002.exr", &folder.read("whole.0003.exr"));
    folder.succeed(&format!(
        "{orbit} -o turn.exr --checkpoint c.exr --stats again.json"
    ));
    for number in [1, 2] {
        let [turn, whole] = ["turn", "whole"].map(|name| format!("{name}.000{number}.exr"));
        assert!(folder.read(&turn) == folder.read(&whole), "{turn}");
    }
}

/// What was written into a pipe cannot be asked for again, and to open it would wait for ever.
#[cfg(unix)]
#[test]
fn an_orbit_goes_into_pipes() {
    let folder = Folder::new();
    let mut reader = Command::new("sh")
        .args(["-c", "mkfifo t.0001.exr && cat t.0001.exr > first.exr"])
        .current_dir(folder.path(""))
        .spawn()
        .expect("sh");
    while !folder.path("t.0001.exr").exists() {
        sleep(Duration::from_millis(5));
    }
    folder.succeed("render ball.toml --size 8x8 --spp 2 --orbit 2 -o t.exr --checkpoint c.exr");
    assert!(reader.wait().expect("it ends").success());
    folder.succeed("render ball.toml --size 8x8 --spp 2 --orbit 2 -o file.exr");
    assert!(folder.read("first.exr") == folder.read("file.0001.exr"));
}

/// The size of the cache stays what it was, even if other programs left less memory then than now.
#[test]
fn what_memory_allowed_before_stands() {
    let folder = Folder::new();
    let plan = folder.succeed("plan ball.toml --variant caching --json");
    let plan: serde_json::Value = serde_json::from_slice(&plan.stdout).expect("JSON");
    let less = plan["planned_bytes"].as_u64().expect("bytes") - 1;
    let render = "render ball.toml --variant caching -o a.exr --stats s.json";
    let kept = format!("{render} --spp 8 --checkpoint c.exr");
    let cache = |arguments: &str| {
        folder.succeed(arguments);
        let stats = folder.json("s.json");
        let [nodes, format] = ["dims", "format"].map(|key| stats["cache"][key].clone());
        assert!(!nodes.is_null() && !format.is_null(), "{stats}");
        [nodes, format]
    };
    let small = cache(&format!("{kept} --vram-budget {less}"));
    let picture = folder.read("a.exr");
    assert_eq!(cache(&kept), small);
    assert!(folder.read("a.exr") == picture);
    let longer = kept.replace("--spp 8", "--spp 16");
    assert_eq!(cache(&longer), small);
    assert_ne!(cache(&format!("{render} --spp 8")), small);
}

/// What `--restart` ignores is there until something takes its place.
#[test]
fn a_restart_that_fails_costs_nothing() {
    let folder = Folder::new();
    let render = "render ball.toml --spp 8 -o a.exr --checkpoint c.exr";
    folder.succeed(&format!("{render} --variant caching"));
    let before = ["c.exr", "c.exr.cache"].map(|name| folder.read(name));
    for (flags, status) in [("--variant published", 3), ("--vram-budget 1000", 4)] {
        refused(&folder, &format!("{render} --restart {flags}"), status);
    }
    assert!(["c.exr", "c.exr.cache"].map(|name| folder.read(name)) == before);
    let uncached = format!("{render} --variant non-caching");
    folder.succeed(&format!("{uncached} --restart"));
    assert!(!folder.path("c.exr.cache").exists());
    folder.succeed(&uncached);
    // A link to a checkpoint stays one.
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("c.exr", folder.path("link.exr")).expect("a link");
        let linked = "render ball.toml --spp 8 -o a.exr --checkpoint link.exr --variant caching";
        folder.succeed(&format!("{linked} --restart"));
        assert!(folder.path("link.exr").is_symlink());
        assert!(folder.path("c.exr.cache").exists());
        folder.succeed(linked);
    }
}

/// A medium that begins beyond the volume's values leaves the cache without a node.
#[test]
fn a_cache_without_nodes_is_continued() {
    let folder = Folder::new();
    let render = "render ball.toml --variant caching -o a.exr --checkpoint c.exr \
                  --set medium.transfer.0.value=300 --set medium.transfer.1.value=400";
    folder.succeed(&format!("{render} --spp 4"));
    folder.succeed(&format!("{render} --spp 8"));
}

/// A batch that was cut short cannot be continued: the last checkpoint stays, and was written before a batch that was
/// to last. A shard that reads the light of such a cache knows its error.
#[cfg(unix)]
#[test]
fn an_interruption_within_a_batch_is_told_of() {
    let folder = Folder::new();
    let child = started(
        &folder,
        "render ball.toml --variant caching --cache-scale 1 --size 64x64 --samples 0..1000000 -o a.exr \
         --set medium.density=2 --set medium.g=0.9 --set surfaces.iso=[] \
         --checkpoint c.exr --checkpoint-every 1",
    );
    // Batches double: the next one lasts longer than half of the time between the last two checkpoints.
    let began = Instant::now();
    let written = || std::fs::metadata(folder.path("c.exr")).and_then(|file| file.modified());
    let mut last = None;
    let between = loop {
        assert!(began.elapsed() < PATIENCE);
        sleep(Duration::from_millis(5));
        let before = last;
        last = written().ok();
        if let (Some(before), Some(last)) = (before, last)
            && let Ok(between) = last.duration_since(before)
            && between > Duration::from_millis(400)
        {
            break between;
        }
    };
    sleep(between / 2);
    let sent = SystemTime::now();
    send(Signal::INT, &child);
    let said = ends(child, 130);
    let note = "note: no checkpoint was written at the end, since the interruption came in the middle of a batch of the \
                cache's paths: c.exr is as it was before";
    assert!(said.contains(note), "{said}");
    assert!(written().expect("a checkpoint") <= sent);
    let fills = &shard_header(&folder, "a.exr")["fills"];
    assert!(fills[0]["relative_error"].is_number(), "{fills}");
}

/// By SIGTERM, as a scheduler does it; SIGUSR1 asks for a checkpoint before that.
#[cfg(unix)]
#[test]
fn signals_leave_a_checkpoint() {
    let folder = Folder::new();
    let render =
        "render ball.toml --variant non-caching --samples 32..100000 -o a.exr --checkpoint c.exr";
    let mut child = started(&folder, render);
    let lock = folder.path("c.exr.lock");
    wait_until(&mut child, "a lock", || lock.exists());
    let began = Instant::now();
    while !folder.path("c.exr").exists() {
        assert!(began.elapsed() < PATIENCE);
        sleep(Duration::from_millis(200));
        send(Signal::USR1, &child);
    }
    send(Signal::TERM, &child);
    let said = ends(child, 143);
    assert!(said.contains("stopped because of SIGTERM"), "{said}");
    let merged = folder.succeed("merge merged.exr c.exr");
    let merged = text(&merged.stderr).to_string();
    assert!(
        merged.contains("note: the samples 0..32 are in none of the files"),
        "{merged}"
    );

    let mut second = started(&folder, render);
    wait_until(&mut second, "a lock", || lock.exists());
    let said = refused_while_there_is_a_lock(&folder, render);
    assert!(
        said.contains("another process uses this checkpoint"),
        "{said}"
    );
    send(Signal::TERM, &second);
    ends(second, 143);
}

fn refused_while_there_is_a_lock(folder: &Folder, arguments: &str) -> String {
    let output = folder.run(arguments);
    assert_eq!(output.status.code(), Some(3), "{output:?}");
    text(&output.stderr).to_string()
}

/// A picture of an orbit that is gone is rendered again, but not by halves: no checkpoint would say so.
#[cfg(unix)]
#[test]
fn an_earlier_picture_is_whole_or_not_there() {
    let folder = Folder::new();
    let orbit = format!(
        "render ball.toml --variant non-caching --size 96x64 --spp 1500 --orbit 2 -o turn.exr {OFTEN}"
    );
    let modified = |name| std::fs::metadata(folder.path(name)).and_then(|about| about.modified());
    let mut child = started(&folder, &orbit);
    let lock = folder.path("c.exr.lock");
    wait_until(&mut child, "a lock", || lock.exists());
    let locked = Instant::now();
    wait_until(&mut child, "a checkpoint", || modified("c.exr").is_ok());
    let compiling = locked.elapsed();
    wait_until(&mut child, "a checkpoint of the second picture", || {
        let times = modified("turn.0001.exr").ok().zip(modified("c.exr").ok());
        times.is_some_and(|(picture, checkpoint)| checkpoint > picture)
    });
    send(Signal::INT, &child);
    ends(child, 130);
    let first = folder.path("turn.0001.exr");
    std::fs::remove_file(&first).expect("it was there");
    let checkpoint = folder.read("c.exr");
    // Nothing says when compiling is over, and it may take less time now that its results are kept. The picture takes longer.
    let was_under_way = (0..20).any(|n| {
        let mut child = started(&folder, &orbit);
        wait_until(&mut child, "a lock", || lock.exists());
        sleep(compiling.mul_f64(0.3 * 1.3_f64.powi(n)));
        send(Signal::INT, &child);
        let said = ends(child, 130);
        assert!(!first.exists() && folder.read("c.exr") == checkpoint);
        said.contains("interrupted before there was a picture to write")
    });
    assert!(was_under_way, "compiling took longer each time");
}

/// What has been sampled is kept, also where the folder of the pictures is gone.
#[test]
fn an_orbit_without_a_folder_leaves_a_checkpoint() {
    let folder = Folder::new();
    let pictures = folder.path("turns");
    std::fs::create_dir(&pictures).expect("a folder");
    let orbit = "render ball.toml --variant non-caching --size 96x64 --spp 384 --orbit 2 \
                 -o turns/turn.exr --checkpoint c.exr --checkpoint-every 600";
    let mut child = started(&folder, orbit);
    let first = pictures.join("turn.0001.exr");
    wait_until(&mut child, "a picture", || first.exists());
    std::fs::remove_dir_all(&pictures).expect("a folder with a picture");
    let said = ends(child, 3);
    assert!(said.contains("turns does not exist"), "{said}");
    assert_eq!(shard_header(&folder, "c.exr")["picture"], 2);
    std::fs::create_dir(&pictures).expect("a folder");
    folder.succeed(orbit);
    assert!(first.exists() && pictures.join("turn.0002.exr").exists());
}

/// A process that is killed between the filling and its first picture has spent the time of the filling.
#[test]
fn the_time_of_a_filling_counts_after_a_kill() {
    let folder = Folder::new();
    let render = "render ball.toml --variant caching --cache-scale 1 --size 8x8 --spp 64 -o a.exr --checkpoint c.exr";
    folder.succeed(render);
    let cache = folder.read("c.exr.cache");
    let cache = String::from_utf8_lossy(&cache);
    let took = cache.split("\"took\":").nth(1).expect("a time");
    let took = took.split_inclusive('}').next().expect("its end");
    let filling: Duration = serde_json::from_str(took).expect("JSON");
    std::fs::remove_file(folder.path("c.exr")).unwrap();
    folder.succeed(render);
    let seconds = shard_header(&folder, "c.exr")["seconds"].as_f64();
    assert!(
        seconds > Some(filling.as_secs_f64()),
        "{seconds:?} {filling:?}"
    );
}

/// The header of a shard or of a checkpoint.
pub fn shard_header(folder: &Folder, file: &str) -> serde_json::Value {
    let picture = folder.exr(file);
    let name = exr::prelude::Text::from("isolume.shard");
    let own = picture.layer_data[0].attributes.other.get(&name);
    let header = match own.or(picture.attributes.other.get(&name)) {
        Some(exr::prelude::AttributeValue::Text(text)) => text.to_string(),
        other => panic!("{other:?}"),
    };
    serde_json::from_str(&header).expect("JSON")
}

#[test]
fn statistics_tell_what_earlier_runs_have_done() {
    let folder = Folder::new();
    let render = "render ball.toml --variant non-caching -o a.exr --checkpoint c.exr";
    folder.succeed(&format!("{render} --spp 4 --stats first.json"));
    folder.succeed(&format!("{render} --spp 8 --stats both.json"));
    let (first, both) = (folder.json("first.json"), folder.json("both.json"));
    assert!(first.get("continued").is_none(), "{first}");
    assert_eq!(both["continued"]["paths"], first["paths"]);
    // The checkpoint at the end has its time as well.
    let spent = [&both["continued"]["wall_s"], &first["views"][0]["wall_s"]].map(number);
    assert!(spent[0] >= spent[1] && spent[1] > 0.0, "{spent:?}");
    assert_eq!(number(&both["paths"]), 2.0 * number(&first["paths"]));
}

/// lavapipe's name tells the width of its vectors.
#[test]
fn a_shard_names_the_devices_of_all_its_runs() {
    let folder = Folder::new();
    let of = |file: &str| shard_header(&folder, file)["devices"].clone();
    let render = "render ball.toml --variant non-caching --checkpoint c.exr --samples";
    let mut elsewhere = folder.isolume(&format!("{render} 0..4 -o a.exr"));
    let output = ended(elsewhere.env("LP_NATIVE_VECTOR_WIDTH", "128"));
    assert!(output.status.success(), "{output:?}");
    folder.succeed("render ball.toml --variant non-caching --samples 0..4 -o b.exr");
    folder.succeed(&format!("{render} 0..8 -o c0.exr"));
    let mut both = vec![of("a.exr")[0].clone(), of("b.exr")[0].clone()];
    both.dedup();
    assert_eq!(of("c0.exr"), serde_json::Value::from(both));
}

/// A cache that was filled once serves all shards: they merge to what a single run reads from it.
#[test]
fn one_filling_is_shipped_to_all_shards() {
    let folder = Folder::new();
    let render = "render ball.toml --variant caching --cache-scale 0.5";
    folder.succeed(&format!(
        "{render} --samples 0..128 -o single.exr --checkpoint s.exr"
    ));
    let cache = folder.read("s.exr.cache");
    for (name, range) in [("a", "0..64"), ("b", "64..128")] {
        folder.write(&format!("{name}.exr.cache"), &cache);
        folder.succeed(&format!(
            "{render} --samples {range} -o {name}.out.exr --checkpoint {name}.exr"
        ));
        assert!(folder.read(&format!("{name}.exr.cache")) == cache);
    }
    let merged = folder.succeed("merge merged.exr a.out.exr b.out.exr");
    assert!(!text(&merged.stderr).contains("note"), "{merged:?}");
    let [single, merged] = ["single.exr", "merged.exr"].map(|name| folder.exr(name));
    let [mean, stderr] = ["", "stderr."].map(|p| crate::shards::difference(&single, &merged, p));
    assert!(mean <= 1e-6 && stderr <= 0.01, "{mean:.1e} {stderr:.1e}");
}
