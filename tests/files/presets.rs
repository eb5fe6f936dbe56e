//! A bare volume gets a scene that shows something, or a sentence that says why it cannot.

use std::path::Path;

use isolume::error::Result;
use isolume::scene::Opened;
use isolume::scene::preset::Preset;
use isolume::scene::volume::{Quantity, Volume, VoxelType, Voxels};
use isolume::scene::{Background, Edit, describe, open};

/// One row of voxels.
fn volume(voxels: Voxels, offset: f64, range: [f64; 2], voxel_type: VoxelType) -> Volume {
    let dims = [voxels.len() as u32, 1, 1];
    let mut volume = Volume::from_values(dims, [1.0; 3], voxels).unwrap();
    volume.offset = offset;
    volume.range = range;
    volume.voxel_type = voxel_type;
    volume.notes = vec!["a note of the loader".to_string()];
    volume
}

/// As many voxels of each value as said.
fn bytes(counts: &[(u8, usize)]) -> Volume {
    let voxels: Vec<u8> = counts
        .iter()
        .flat_map(|&(value, n)| vec![value; n])
        .collect();
    let low = *voxels.iter().min().unwrap();
    let high = *voxels.iter().max().unwrap();
    volume(
        Voxels::U8(voxels),
        0.0,
        [low.into(), high.into()],
        VoxelType::U8,
    )
}

/// Hounsfield units from −1000 up to `high`.
fn hounsfield(high: i32) -> Volume {
    let stored = (-1000..=high).map(|value| (value + 32768) as u16).collect();
    volume(
        Voxels::U16(stored),
        -32768.0,
        [-1000.0, high.into()],
        VoxelType::I16,
    )
}

fn opened(volume: Volume, preset: Preset, changes: &[&str]) -> Result<Opened> {
    let edits: Vec<Edit> = changes
        .iter()
        .map(|change| change.parse().unwrap())
        .collect();
    open(Path::new("data/head.nrrd"), preset, &edits, |path, _| {
        assert_eq!(path, Path::new("data/head.nrrd"));
        Ok(volume)
    })
}

#[test]
fn hounsfield_units_show_bone_in_soft_tissue() {
    let opened = opened(hounsfield(2000), Preset::Auto, &[]).unwrap();
    let scene = &opened.scene;
    let medium = scene.medium.as_ref().unwrap();
    assert_eq!(scene.surfaces.iso[0].value, 300.0);
    assert_eq!(medium.classify(-900.0).0, 0.0, "air is clear");
    assert!(
        medium.classify(-300.0).0 > medium.classify(40.0).0,
        "skin is denser than what lies behind it"
    );
    assert!(
        medium.classify(40.0).0 > 0.0 && medium.classify(2000.0).0 < 0.1,
        "what lies around the bone is faint"
    );
    assert_eq!(
        (scene.lights.suns.len(), opened.notes[0].as_str()),
        (1, "a note of the loader")
    );
    // The sun shines from above, from the viewer's side.
    assert!(scene.lights.suns[0].direction[1] < 0.0 && scene.lights.suns[0].direction[2] < 0.0);
    let again = describe(&opened.file, &opened.volume, scene);
    assert!(again.contains("path = \"data/head.nrrd\""), "{again}");
}

#[test]
fn auto_tells_ct_from_the_rest() {
    let iso =
        |volume: Volume, preset| opened(volume, preset, &[]).unwrap().scene.surfaces.iso[0].value;
    let floats = Voxels::F32((-1000..=2000).map(|v| v as f32).collect());
    let floats = volume(floats, 0.0, [-1000.0, 2000.0], VoxelType::F32);
    assert_ne!(
        iso(floats.clone(), Preset::Auto),
        300.0,
        "floats need not be Hounsfield units"
    );
    assert_eq!(iso(floats, Preset::Ct), 300.0);
    assert_ne!(iso(hounsfield(2000), Preset::Generic), 300.0);
}

#[test]
fn ct_without_bone_has_no_surface() {
    let scene = opened(hounsfield(200), Preset::Auto, &[]).unwrap().scene;
    assert!(scene.surfaces.iso.is_empty() && scene.medium.is_some());
    let air = opened(hounsfield(-950), Preset::Auto, &[])
        .unwrap_err()
        .to_string();
    assert!(
        air.starts_with("data/head.nrrd (preset ct): medium.transfer: "),
        "{air}"
    );
    assert!(
        air.contains("opacity starts at -450, the data end at -950"),
        "{air}"
    );
}

#[test]
fn generic_thresholds_lie_between_the_materials() {
    // Mostly empty; then noise, flesh and bone, each spread a little.
    let counts = [
        (0, 9000),
        (1, 300),
        (2, 100),
        (4, 40),
        (80, 300),
        (84, 400),
        (88, 300),
        (200, 90),
        (210, 90),
    ];
    let scene = opened(bytes(&counts), Preset::Auto, &[]).unwrap().scene;
    let bone = scene.surfaces.iso[0].value;
    assert!((88.0..200.0).contains(&bone), "{bone}");
    let medium = scene.medium.unwrap();
    assert_eq!(medium.classify(4.0).0, 0.0, "noise is clear");
    assert!(medium.classify(84.0).0 > 0.0, "flesh is not");
}

#[test]
fn a_mask_becomes_a_surface() {
    let opened = opened(bytes(&[(0, 90), (1, 10)]), Preset::Auto, &[]).unwrap();
    assert_eq!(opened.scene.surfaces.iso[0].value, 0.5);
    let labels = bytes(&[(0, 90), (1, 10), (2, 5)]);
    let scene = self::opened(labels, Preset::Auto, &[]).unwrap().scene;
    assert_eq!(scene.surfaces.iso[0].value, 1.5);
    let medium = scene.medium.unwrap();
    assert_eq!(
        (medium.classify(0.0).0, medium.classify(1.0).0 > 0.0),
        (0.0, true)
    );
}

/// From behind as from the front: over the viewer's left shoulder.
#[test]
fn the_sun_stands_behind_the_viewer() {
    for view in ["+x", "-x", "+y", "-y", "+z", "-z"] {
        let scene = opened(
            hounsfield(2000),
            Preset::Auto,
            &[&format!("camera.view=\"{view}\"")],
        );
        let scene = scene.unwrap().scene;
        let [forward, right, up] = scene.camera.basis();
        let travels = glam::DVec3::from(scene.lights.suns[0].direction);
        let along = [forward, right, up].map(|axis| axis.dot(travels));
        assert!(
            along[0] > 0.3 && along[1] > 0.2 && along[2] < -0.3,
            "{view}: {along:?}"
        );
    }
}

/// As OpenVDB says of fog volumes and level sets.
#[test]
fn densities_become_a_medium_and_distances_a_surface() {
    let values = (0..100).map(|n| n as f32 / 50.0).collect();
    let mut fog = volume(Voxels::F32(values), 0.0, [0.0, 1.98], VoxelType::F32);
    fog.quantity = Some(Quantity::Density);
    let scene = opened(fog, Preset::Auto, &[]).unwrap().scene;
    assert!(scene.surfaces.iso.is_empty());
    let medium = scene.medium.unwrap();
    for (value, opacity) in [(0.0, 0.0), (0.99, 0.5), (1.98, 1.0)] {
        assert!((medium.classify(value).0 - opacity).abs() < 1e-6, "{value}");
    }
    let values = (0..100).map(|n| n as f32 / 10.0 - 3.0).collect();
    let mut distances = volume(Voxels::F32(values), 0.0, [-3.0, 6.9], VoxelType::F32);
    distances.quantity = Some(Quantity::Distance);
    let scene = opened(distances, Preset::Auto, &[]).unwrap().scene;
    assert!(scene.medium.is_none());
    let values: Vec<f64> = scene.surfaces.iso.iter().map(|iso| iso.value).collect();
    assert_eq!(values, [0.0]);
}

#[test]
fn a_constant_volume_says_so() {
    for preset in [Preset::Auto, Preset::Ct, Preset::Generic] {
        let error = opened(bytes(&[(7, 30)]), preset, &[]).unwrap_err();
        let said = "data/head.nrrd: every voxel is 7, so there is nothing to see";
        assert_eq!((error.exit_status(), error.to_string().as_str()), (3, said));
    }
}

#[test]
fn edits_change_a_preset_like_a_file() {
    let changes = [
        "render.background=transparent",
        "volume.spacing=[1, 2, 3]",
        "surfaces.iso.0.opacity=0.5",
    ];
    let opened = opened(hounsfield(2000), Preset::Auto, &changes).unwrap();
    assert_eq!(opened.scene.render.background, Background::Transparent);
    assert_eq!(opened.scene.surfaces.iso[0].opacity, 0.5);
    assert_eq!(opened.file.volume.spacing, Some([1.0, 2.0, 3.0]));
    let error = self::opened(hounsfield(2000), Preset::Auto, &["medium.g=2"]).unwrap_err();
    assert!(
        error
            .to_string()
            .starts_with("--set medium.g=2: medium.g: found 2"),
        "{error}"
    );
    let error = self::opened(hounsfield(2000), Preset::Auto, &["volume.spacing=0"]).unwrap_err();
    assert!(
        error
            .to_string()
            .starts_with("--set volume.spacing=0: volume.spacing"),
        "{error}"
    );
}

#[test]
fn histograms_count_every_voxel_once() {
    let histogram = bytes(&[(3, 5), (4, 2), (7, 1)]).histogram(256).unwrap();
    assert_eq!(histogram.counts, [5, 2, 0, 0, 1]);
    assert_eq!((histogram.value(0), histogram.value(4)), (3.0, 7.0));
    let coarse = hounsfield(2000).histogram(10).unwrap();
    assert_eq!(coarse.counts.iter().sum::<u64>(), 3001);
    assert!(
        coarse
            .counts
            .iter()
            .all(|count| (299..=302).contains(count)),
        "{coarse:?}"
    );
    let flat = bytes(&[(9, 4)]).histogram(16).unwrap();
    assert_eq!(
        (flat.counts.as_slice(), flat.value(0)),
        ([4].as_slice(), 9.0)
    );
}
