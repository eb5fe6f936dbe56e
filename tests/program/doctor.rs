//! `isolume doctor` on the device at hand: the table, the filter, the closed forms and the rates.

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
        let rate = |name: &str| device["rates"][name].as_f64().expect("a rate");
        assert!(rate("samples") > 1e5 && rate("copied_bytes") > 1e6);
        assert!(rate("samples_cached") > 0.5 * rate("samples"));
    }
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
