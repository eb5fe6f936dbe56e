//! What a volume that streams leaves for the next run: nothing that looks finished and is not, nothing that is damaged and
//! is believed.

use std::fs::File;
use std::io::Write;
use std::process::{Child, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use flate2::Compression;
use flate2::write::GzEncoder;
use rustix::process::Signal;
use serde_json::Value;

use crate::checkpoints::{OFTEN, survive};
use crate::number::number;
use crate::stopping::{PATIENCE, send_to};
use crate::{Folder, ended, text};

/// Voxels along x, y and z: more than are kept in memory of a compressed file.
const DIMS: [usize; 3] = [256, 256, 260];
const RENDER: &str =
    "render ball.toml --spp 1 --variant non-caching --set volume.path=\"v.nrrd\" --cache-dir c";
const STREAMED: &str = "--vram-budget 12MiB";

/// It holds a ball of 16 bits in a file that can only be read from front to back.
fn folder() -> Folder {
    let folder = Folder::new();
    write_volume(&folder, 9000.0);
    folder
}

fn write_volume(folder: &Folder, inside: f64) {
    let mut file = GzEncoder::new(begun(folder, "gzip"), Compression::fast());
    write_voxels(&mut file, inside);
    file.finish().expect("voxels");
}

/// The file with its header.
fn begun(folder: &Folder, encoding: &str) -> File {
    let [x, y, z] = DIMS;
    let header = format!(
        "NRRD0004\ntype: uint16\ndimension: 3\nsizes: {x} {y} {z}\nendian: little\nspacings: 0.1 0.1 0.1\n\
         encoding: {encoding}\n\n"
    );
    let mut file = File::create(folder.path("v.nrrd")).expect("a file");
    file.write_all(header.as_bytes()).expect("a header");
    file
}

fn write_voxels(file: &mut impl Write, inside: f64) {
    let [x, y, z] = DIMS;
    let mut slice = Vec::new();
    for k in 0..z {
        slice.clear();
        for (j, i) in (0..y).flat_map(|j| (0..x).map(move |i| (j, i))) {
            let [dx, dy, dz] = [i as f64 - 127.5, j as f64 - 127.5, k as f64 - 130.5];
            let distance = (dx * dx + dy * dy + dz * dz).sqrt();
            let grain = ((i * 7 + j * 13 + k * 29) % 16) as f64;
            let value = (inside - 70.0 * distance).max(0.0) / 50.0 + grain;
            slice.extend_from_slice(&(value as u16).to_le_bytes());
        }
        file.write_all(&slice).expect("a slice");
    }
}

/// Renders in bricks. Returns what it said.
#[track_caller]
fn render(folder: &Folder, picture: &str) -> String {
    let output = folder.succeed(&format!("{RENDER} {STREAMED} -o {picture}"));
    text(&output.stderr).to_string()
}

#[test]
fn the_next_run_copies_nothing() {
    let folder = folder();
    folder.succeed(&format!("{RENDER} -o whole.exr"));
    assert!(!folder.path("c").exists());
    // It stands still in the middle of its copy, so that the other finds no store.
    let beside = copying(&folder);
    send_to(Signal::STOP, &beside);
    assert!(render(&folder, "b.exr").contains("copying v.nrrd to c"));
    send_to(Signal::CONT, &beside);
    assert!(wait(beside).success());
    assert!(!render(&folder, "d.exr").contains("copying"));
    for picture in ["a.exr", "b.exr", "d.exr"] {
        assert!(
            folder.read(picture) == folder.read("whole.exr"),
            "{picture}"
        );
    }
    assert_eq!(folder.names_in("c").len(), 1);

    write_volume(&folder, 8000.0);
    assert!(render(&folder, "e.exr").contains("copying"));
    assert!(folder.read("e.exr") != folder.read("a.exr"));
    folder.write("c/mine.txt", b"mine");
    let cleaned = folder.succeed("clean --cache-dir c");
    let said = text(&cleaned.stdout);
    assert!(said.starts_with("1 store was removed from c, "), "{said}");
    assert_eq!(folder.names_in("c"), ["mine.txt"]);
}

/// Rows of a plain file's bricks are read together, and driven out of the little memory that the host may spend.
#[test]
fn a_plain_file_streams_through_little_memory() {
    let folder = Folder::new();
    write_voxels(&mut begun(&folder, "raw"), 9000.0);
    folder.succeed(&format!("{RENDER} -o whole.exr"));
    for budget in ["1MiB", "1"] {
        let streamed = format!("{RENDER} {STREAMED} --ram-budget {budget} -o a.exr");
        let output = folder.succeed(&format!("{streamed} --stats s.json"));
        assert!(!text(&output.stderr).contains("copying"), "{output:?}");
        assert!(folder.read("a.exr") == folder.read("whole.exr"), "{budget}");
        let bricks = &folder.json("s.json")["bricks"];
        let keys = ["total", "needed", "resident", "loads", "bytes_read"];
        let [total, needed, resident, loads, read] = keys.map(|key| number(&bricks[key]));
        // Of a side of 32 voxels.
        assert_eq!(total, (8 * 8 * 9) as f64, "{bricks}");
        assert!(0.0 < resident && resident < loads, "{bricks}");
        assert!(resident <= needed && needed <= total, "{bricks}");
        assert!(read > loads, "{bricks}");
        let waited = number(&bricks["waited_share"]);
        assert!((0.0..=1.0).contains(&waited), "{bricks}");
    }
    // Of which no more is counted than the volume's bricks take.
    folder.succeed(&format!("{RENDER} {STREAMED} --ram-budget 100% -o a.exr"));
    assert!(folder.read("a.exr") == folder.read("whole.exr"));
}

#[test]
fn a_render_that_streams_goes_on_where_it_was_killed() {
    let folder = folder();
    let render = format!("{RENDER} {STREAMED} --size 48x32").replace("--spp 1", "--spp 512");
    folder.succeed(&format!("{render} -o whole.exr"));
    let mut random = fastrand::Rng::with_seed(22);
    let kills = survive(
        &folder,
        &format!("{render} -o again.exr {OFTEN}"),
        &mut random,
    );
    assert!(kills > 0);
    assert!(folder.read("again.exr") == folder.read("whole.exr"));
}

/// The trial of `auto` is the beginning of the picture, not of another: where the volume streams, which leaves no room for
/// a cache, and where it is whole, the picture has few pixels, and one is soon done.
#[test]
fn what_a_trial_has_sampled_is_kept() {
    let folder = folder();
    for (budget, error) in [(STREAMED, 0.03), ("--vram-budget 1GiB", 0.2)] {
        let scene = format!("{RENDER} {budget} --size 48x48").replace("--spp 1", "");
        let auto = scene.replace("non-caching", "auto");
        folder.succeed(&format!(
            "{auto} --error {error} -o auto.exr --stats s.json"
        ));
        let stats = folder.json("s.json");
        assert_eq!(stats["variant"], "non-caching", "{stats}");
        folder.succeed(&format!("{scene} --spp {} -o without.exr", stats["spp"]));
        let compared = folder.succeed("compare auto.exr without.exr --json");
        let figures: Value = serde_json::from_slice(&compared.stdout).expect("JSON");
        assert_eq!(figures["mse"].as_f64(), Some(0.0), "{figures}");
    }
}

#[test]
fn the_plan_says_how_much_will_be_read() {
    let folder = folder();
    let plan = |ram_budget: &str| {
        let scene = RENDER.replace("render", "plan").replace("--spp 1", "");
        let arguments = format!("{scene} {STREAMED} --ram-budget {ram_budget} --json");
        let plan: Value = serde_json::from_slice(&folder.succeed(&arguments).stdout).expect("JSON");
        ["first_read_bytes", "later_read_bytes"].map(|key| number(&plan["bricks"][key]))
    };
    let [first, later] = plan("1GiB");
    assert_eq!(later, 0.0);
    folder.succeed(&format!("{RENDER} {STREAMED} -o a.exr --stats s.json"));
    let read = number(&folder.json("s.json")["bricks"]["bytes_read"]);
    // A sample's paths go through a part of the bricks.
    assert!(first >= read && read > first / 8.0, "{first} {read}");
    let brick = f64::from(2 * 33 * 33 * 33);
    assert_eq!(plan("1MiB"), [first, first - f64::from(1 << 20)]);
    assert_eq!(first % brick, 0.0);
}

/// `ISOLUME_KILLS=20` kills more copies than three.
#[test]
fn a_copy_that_is_ended_leaves_nothing_that_looks_finished() {
    let kills = std::env::var("ISOLUME_KILLS");
    let kills: u64 = kills.map_or(3, |n| n.parse().expect("ISOLUME_KILLS: a number"));
    let folder = folder();
    folder.succeed(&format!("{RENDER} -o whole.exr"));
    let is_begun = |name: &String| name.starts_with('.');
    for kill in 0..kills {
        let mut child = copying(&folder);
        sleep(Duration::from_millis(60 * kill / (kills - 1).max(1)));
        child.kill().expect("a process");
        wait(child);
        let left = folder.names_in("c");
        assert!(left.iter().all(is_begun), "{left:?}");
        assert!(render(&folder, "a.exr").contains("copying"));
        assert!(folder.read("a.exr") == folder.read("whole.exr"));
        assert_eq!(folder.names_in("c").len(), 1);
        folder.succeed("clean --cache-dir c");
    }
    println!("{kills} copies were killed");
    #[cfg(unix)]
    {
        let child = copying(&folder);
        send_to(Signal::TERM, &child);
        assert_eq!(wait(child).code(), Some(143));
        assert_eq!(folder.names_in("c"), [""; 0]);
    }
}

/// A process that is about to copy, as its temporary file shows.
fn copying(folder: &Folder) -> Child {
    let mut command = folder.isolume(&format!("{RENDER} {STREAMED} -o a.exr"));
    // Validation takes long to end.
    let command = command.env_remove("ISOLUME_VALIDATION");
    let before = names(folder);
    let child = command.stderr(Stdio::null()).spawn().expect("the program");
    let began = Instant::now();
    while names(folder).iter().all(|name| before.contains(name)) {
        assert!(began.elapsed() < PATIENCE, "it never copies");
        sleep(Duration::from_millis(1));
    }
    child
}

fn names(folder: &Folder) -> Vec<String> {
    if folder.path("c").exists() {
        folder.names_in("c")
    } else {
        Vec::new()
    }
}

fn wait(mut child: Child) -> std::process::ExitStatus {
    child.wait().expect("an exit status")
}

#[test]
fn damage_is_found() {
    let folder = folder();
    render(&folder, "a.exr");
    let store = format!("c/{}", folder.names_in("c")[0]);
    let whole = folder.read(&store);

    let mut damaged = whole.clone();
    let middle = whole.len() / 4..whole.len() * 3 / 4;
    damaged[middle]
        .iter_mut()
        .step_by(64)
        .for_each(|byte| *byte ^= 1);
    folder.write(&store, &damaged);
    let output = ended(&mut folder.isolume(&format!("{RENDER} {STREAMED} -o b.exr")));
    let said = text(&output.stderr);
    assert_eq!(output.status.code(), Some(3), "{said}");
    assert!(
        said.contains(&store) && said.contains("checksum") && said.contains("remove it"),
        "{said}"
    );
    assert!(!folder.path("b.exr").exists());

    // Before a picture is begun, a store can still be made anew.
    folder.write(&store, &whole[..whole.len() - 5]);
    let said = render(&folder, "b.exr");
    assert!(
        said.contains("is damaged") && said.contains("copying"),
        "{said}"
    );
    assert!(folder.read("a.exr") == folder.read("b.exr"));
    assert!(folder.read(&store) == whole);
}

#[test]
fn a_folder_that_cannot_be_written_is_named() {
    let folder = folder();
    folder.write("c", b"a file where the folder should be");
    let output = ended(&mut folder.isolume(&format!("{RENDER} {STREAMED} -o a.exr")));
    let said = text(&output.stderr);
    assert_eq!(output.status.code(), Some(3), "{said}");
    let last = said.lines().last().expect("a sentence");
    assert!(
        last.contains("cannot be written in c:") && last.contains("--cache-dir"),
        "{said}"
    );
    assert!(!folder.path("a.exr").exists());
}
