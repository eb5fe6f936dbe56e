//! `isolume doctor` on the device at hand: the table, the filter, the closed forms and the rates.

use std::path::Path;

use serde_json::Value;

use crate::{Folder, text};

/// Its page and its JSON say the same; that all holds is what the rest of the suite shows.
#[test]
fn a_device_that_renders_is_found_well() {
    let output = Folder::empty().succeed("doctor --json");
    let devices: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let devices = devices.as_array().expect("a list");
    assert!(!devices.is_empty(), "{}", text(&output.stdout));
    for device in devices {
        assert_eq!(device["holds"], true, "{device:#}");
        assert_eq!(device["fault"], Value::Null);
        let needs = device["needs"].as_array().expect("a table");
        assert!(needs.iter().any(|need| need["name"] == "scalarBlockLayout"));
        let forms = device["closed_forms"].as_array().expect("a list");
        assert!(!forms.is_empty() && forms.iter().all(|form| form["holds"] == true));
        // The most telling ones come first. A slow device may not get to all of them in its time.
        let is_decided = |form: &Value| form["decided"] == true;
        assert!(forms.iter().take(2).all(is_decided), "{device:#}");
        let rate = |name: &str| device["rates"][name].as_f64().expect("a rate");
        assert!(rate("samples") > 1e5 && rate("copied_bytes") > 1e6);
        assert!(rate("samples_cached") > 0.5 * rate("samples"));
    }
}

/// What an H100 once did: positions between voxels are rounded, and some rays miss surfaces.
#[test]
fn a_device_that_rounds_positions_and_misses_surfaces_is_found() {
    let folder = Folder::empty();
    let own = Path::new(env!("CARGO_MANIFEST_DIR")).join("glsl");
    let wrong = folder.path("glsl");
    for part in ["", "include"] {
        std::fs::create_dir_all(wrong.join(part)).expect("a folder");
        for file in std::fs::read_dir(own.join(part)).expect("shaders") {
            let file = file.expect("a shader");
            if file.file_type().expect("a type").is_file() {
                let copy = wrong.join(part).join(file.file_name());
                std::fs::copy(file.path(), copy).expect("a copy");
            }
        }
    }
    let replace = |file: &str, right: &str, text: &str| {
        let file = wrong.join(file);
        let before = std::fs::read_to_string(&file).expect("a shader");
        assert!(
            before.contains(right),
            "{} has no `{right}`",
            file.display()
        );
        std::fs::write(&file, before.replace(right, text)).expect("a shader");
    };
    replace(
        "include/volume.glsl",
        "    precise vec4 along_z",
        "    p = round(256.0 * p) / 256.0;\n    precise vec4 along_z",
    );
    replace(
        "include/surface.glsl",
        "return found && !is_void;",
        "return found && !is_void && fract(1e4 * ray.direction.x) > 0.05;",
    );
    let output = folder
        .isolume("doctor --json")
        .env("ISOLUME_GLSL", &wrong)
        .output()
        .expect("the program starts");
    assert_eq!(output.status.code(), Some(5), "{output:?}");
    let devices: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let forms = devices[0]["closed_forms"].as_array().expect("a list");
    for form in forms {
        let is_wrong = [
            "thin shell between two voxels",
            "surface in a medium under a sun",
        ]
        .contains(&form["name"].as_str().expect("a name"));
        // In a white furnace a missed surface is as bright as one that is hit, so that this check cannot tell.
        let is_right = form["name"] != "depth of an isosurface, voxels";
        if is_wrong || is_right {
            assert_eq!(form["holds"], !is_wrong, "{form:#}");
        }
    }
    assert!(forms.iter().any(|form| form["holds"] == false));
}

#[test]
fn without_a_driver_it_ends_with_the_devices_status() {
    let folder = Folder::empty();
    let mut program = folder.isolume("doctor");
    let output = program
        .env("VK_DRIVER_FILES", "/nowhere")
        .env("VK_ICD_FILENAMES", "/nowhere")
        .output()
        .expect("the program starts");
    assert_eq!(output.status.code(), Some(5), "{output:?}");
    assert!(text(&output.stderr).starts_with("isolume: "), "{output:?}");
}
