//! Every class of mistake in a scene file: refused before any volume is read, with one sentence.
//!
//! A line is `TOML => how the message goes on after the file's name`, with ` / ` for a new line.

use isolume::error::{Error, Origin};

use super::{message, parse, resolved};

#[track_caller]
fn refused(mistakes: &str) {
    for line in mistakes
        .lines()
        .map(str::trim)
        .filter(|line| !line.is_empty())
    {
        let (text, expected) = line.split_once(" => ").expect("TOML => message");
        let message = message(parse(&text.trim().replace(" / ", "\n")));
        let expected = format!("scenes/head.toml{}", expected.trim());
        assert!(
            message.starts_with(&expected),
            "{text}\n{message}\nis not\n{expected}"
        );
        assert_eq!(message.lines().count(), 1, "{message}");
    }
}

#[test]
fn syntax_and_unknown_keys() {
    refused(
        r#"
        [volume] / path =                        => :2: not valid TOML:
        [volume] / path = "a" / path = "b"       => :3: volume.path: found a second time, expected once; it is on line 2 as well
        [volume] / path = "a" / [render] / [volume] / time = 1 => :4: volume: found a second time, expected once; it is on line 1
        [[surfaces.iso]] / value = 1 / [[surfaces.iso]] / "value" = 2 / value = 3 => :5: surfaces.iso.1.value: found a second time, expected once; it is on line 4
        render = { size = [1, 1], size = [2, 2] }  => :1: render.size: found a second time, expected once; it is on line 1
        g = 1 / [medum]                          => :1: g: unknown key; it can be volume,
        [medium] / G = 1                           => :2: medium.G: unknown key; did you mean "g"?
        [render] / size = [1, 2, 3]                => :2: render.size: found [1, 2, 3], expected two numbers, as in
        [volume] / crop = [[0, 0, 0], [1, 1, 1], 1] => :2: volume.crop: found [[0, 0, 0], [1, 1, 1], 1], expected two corners
        [render] / variant = 1                     => :2: render.variant: found 1, expected a word in quotes
        [render] / # / [medum]                     => :3: medum: unknown key; did you mean "medium"?
        [medium] / # / densty = 1                  => :3: medium.densty: unknown key; did you mean "density"?
        [medium] / "den`sity" = 1                => :2: medium.den`sity: unknown key; did you mean "density"? It can be density,
        [medium] / origins = 1                   => :2: medium.origins: unknown key
        [[surfaces.iso]] / colour = [1, 1, 1]    => :2: surfaces.iso.0.colour: unknown key; did you mean "color"?
        [[light]] / directon = [1, 1, 1]         => :2: light.0.directon: unknown key; did you mean "direction"?
        [[clip]] / norml = [1, 1, 1]             => :2: clip.0.norml: unknown key; did you mean "normal"?
        [camera] / fov = 30                      => :2: camera.fov: unknown key; did you mean "fov_y"?
        [render] / qqqqqq = 1                    => :2: render.qqqqqq: unknown key; it can be size, max_bounces,
        "#,
    );
}

#[test]
fn wrong_kinds_of_value() {
    refused(
        r#"
        medium = 3                               => :1: medium: found 3, expected a table
        render = [[8, 8]]                        => :1: render: found [[8, 8]], expected a table
        [[camera]] / view = "+x"                 => :1: camera: found [[camera]], expected [camera]
        [light] / type = "environment"           => :1: light: found a table, expected an array of tables: [[light]]
        clip = [[[1, 0, 0], 2.5]]                => :1: clip.0: found [[1, 0, 0], 2.5], expected a table: [[clip]]
        [medium] / g = "abc"                     => :2: medium.g: found "abc", expected a number
        [medium] / [[medium.transfer]] / opacity = 1 => :2: medium.transfer.0.value: missing
        [[light]] / direction = [0, 1, 0]        => :1: light.0.type: missing
        [[light]] / type = "environ`"            => :2: light.0.type: found "environ`"; did you mean "environment"? It can be directional, environment
        [[light]] / type = "directional"         => :1: light.0.direction: missing
        [[light]] / type = "directionl"          => :2: light.0.type: found "directionl"; did you mean "directional"?
        [[clip]] / offset = 1                    => :1: clip.0.normal: missing
        [camera] / eye = [0.0, 1.0]              => :2: camera.eye: found [0.0, 1.0], expected three numbers
        [camera] / eye = [0, 1, 2, 3]            => :2: camera.eye: found [0, 1, 2, 3], expected three numbers, as in
        [camera] / eye = [0, 1, true]            => :2: camera.eye.2: found true, expected a number
        [camera] / view = "anteror"              => :2: camera.view: found "anteror"; did you mean "anterior"?
        [render] / size = [512, -3]              => :2: render.size.1: found -3, expected a whole number
        [render] / size = 512                    => :2: render.size: found 512, expected two numbers
        [volume] / crop = 1                      => :2: volume.crop: found 1, expected two corners
        [render] / max_bounces = 1.5             => :2: render.max_bounces: found 1.5, expected a whole number
        [render] / max_bounces = 1e300           => :2: render.max_bounces: found 1e300, expected a whole number
        [render] / max_bounces = 5000000000      => :2: render.max_bounces: found 5000000000, expected a whole number from 0 to 4294967295
        [render] / cache_scale = 0.3             => :2: render.cache_scale: found 0.3, expected "auto", 1, 0.5
        [render] / background = "black"          => :2: render.background: found "black", expected "environment"
        [render] / tone = "filmc"                => :2: render.tone: found "filmc"; did you mean "filmic"?
        [volume] / type = "uint12"               => :2: volume.type: found "uint12", expected one of uint8
        [volume] / axes = "LLI"                  => :2: volume.axes: found "LLI", expected one of L|R
        [volume] / endian = "middle"             => :2: volume.endian: found "middle"
        "#,
    );
}

#[test]
fn volume_values_out_of_range() {
    refused(
        r#"
        [volume] / dims = [1, 0, 1]              => :2: volume.dims: found [1, 0, 1], expected
        [volume] / spacing = [1, 0, 1]           => :2: volume.spacing: found [1.0, 0.0, 1.0], expected
        [volume] / spacing = [1, -1, 1]          => :2: volume.spacing: found
        [volume] / spacing = [1, 1e16, 1]        => :2: volume.spacing: found [1.0, 1e16, 1.0], expected each to be a number from 1e-15 to 1e15
        [volume] / spacing = [1, inf, 1]         => :2: volume.spacing: found
        [volume] / crop = [[0, 0, 5], [9, 9, 5]] => :2: volume.crop: found [[0, 0, 5], [9, 9, 5]], expected
        "#,
    );
    let file = parse("[medium]\n[[medium.transfer]]\nvalue = 1").unwrap();
    assert!(message(file.volume_path()).starts_with("scenes/head.toml: volume.path: missing"));
}

#[test]
fn medium_values_out_of_range() {
    let medium = |key: &str, value: &str| {
        let table = format!("[medium] / {key} = {value} / [[medium.transfer]] / value = 1");
        refused(&format!("{table} => :2: medium.{key}: found"));
    };
    for g in ["1", "-1", "1.5", "nan", "inf", "-inf"] {
        medium("g", g);
    }
    for density in ["-0.1", "nan", "inf", "1e300"] {
        medium("density", density);
    }
    refused(
        r#"
        [medium] / g = 0.0                       => :1: medium.transfer: found no point, expected at least one
        [medium] / transfer = []                 => :2: medium.transfer: found no point, expected at least one
        "#,
    );
    let point = |line: &str, expected: &str| {
        let first = "[[medium.transfer]] / value = 1 / [[medium.transfer]]";
        refused(&format!("{first} / {line} => {expected}"));
    };
    point(
        "value = nan",
        ":4: medium.transfer.1.value: found NaN, expected a finite number",
    );
    point(
        "value = 0.5",
        ":4: medium.transfer.1.value: found 0.5 after 1, expected",
    );
    point(
        "value = -1e30",
        ":4: medium.transfer.1.value: found -1e30 after 1, expected",
    );
    point(
        "value = 2 / opacity = 1.1",
        ":5: medium.transfer.1.opacity: found 1.1, expected",
    );
    point(
        "value = 2 / opacity = -0.1",
        ":5: medium.transfer.1.opacity: found -0.1, expected",
    );
    point(
        "value = 2 / color = [1, 1.01, 0]",
        ":5: medium.transfer.1.color: found [1.0, 1.01, 0.0]",
    );
    let step = "[[medium.transfer]]\nvalue = 1\n[[medium.transfer]]\nvalue = 1";
    assert!(parse(step).is_ok(), "two points at one value are a step");
}

#[test]
fn surface_values_out_of_range() {
    refused(
        r#"
        [[surfaces.iso]] / value = inf                      => :2: surfaces.iso.0.value: found inf, expected
        [[surfaces.iso]] / value = 5 / color = [2, 0, 0]    => :3: surfaces.iso.0.color: found [2.0, 0.0, 0.0]
        [[surfaces.iso]] / value = 5 / shininess = -1       => :3: surfaces.iso.0.shininess: found -1, expected
        [[surfaces.iso]] / value = 5 / shininess = 1.1e12   => :3: surfaces.iso.0.shininess: found 1.1e12, expected a number from 0 to 1e12
        surfaces.iso = [{ value = 5 }, / { value = 5.0 }]   => :2: surfaces.iso.1.value: found 5, which surfaces.iso.0 has
        "#,
    );
    for name in [
        "opacity",
        "specular",
        "roughness",
        "metallic",
        "specular_tint",
        "sheen",
        "sheen_tint",
        "subsurface",
        "clearcoat",
        "clearcoat_gloss",
    ] {
        let iso = format!("[[surfaces.iso]] / value = 5 / {name}");
        let key = format!(":3: surfaces.iso.0.{name}");
        refused(&format!(
            "{iso} = 1.5 => {key}: found 1.5, expected a number from 0 to 1"
        ));
        refused(&format!(
            "{iso} = nan => {key}: found NaN, expected a number from 0 to 1"
        ));
    }
    let brightest = "[[surfaces.iso]]\nvalue = 5\nshininess = 1e12";
    assert!(resolved(brightest).is_ok());
}

#[test]
fn light_and_clip_values_out_of_range() {
    let sun = "[[light]] / type = \"directional\"";
    let sky = "[[light]] / type = \"environment\"";
    refused(&format!(
        r#"
        {sun} / direction = [0, 0, 0]            => :3: light.0.direction: found [0.0, 0.0, 0.0], expected a direction
        {sun} / direction = [0, nan, 0]          => :3: light.0.direction: found
        {sun} / direction = [0, 1, 0] / irradiance = [1, -1, 1] => :4: light.0.irradiance: found
        {sun} / direction = [0, 1, 0] / radiance = [1, 1, 1]    => :4: light.0.radiance: a light of type
        {sky} / radiance = [1, 1, -1]            => :3: light.0.radiance: found [1.0, 1.0, -1.0]
        {sky} / direction = [0, 1, 0]            => :3: light.0.direction: a light of type
        {sky} / radiance = [1e-26, 0, 0]         => :3: light.0.radiance: found [1e-26, 0.0, 0.0], expected each to be 0 or
        {sun} / direction = [0, 1, 0] / irradiance = [1, 1e16, 0] => :4: light.0.irradiance: found [1.0, 1e16, 0.0], expected
        [[clip]] / normal = [0, 0, 0]            => :2: clip.0.normal: found
        [[clip]] / normal = [1, 0, 0] / offset = nan => :3: clip.0.offset: found NaN
        "#
    ));
}

/// What is computed from values in their ranges may leave them, and could not be read again once it is printed.
#[test]
fn what_follows_from_values_out_of_range() {
    let of = |text: &str| message(resolved(text));
    let offset = of("[[clip]]\nnormal = [1e-37, 0, 0]\noffset = 100");
    let expected = ":3: clip.0.offset: found 100 with a normal of length 1e-37, expected";
    assert!(offset.contains(expected), "{offset}");
    let sky = "[[light]]\ntype = \"environment\"\nradiance = [1e15, 0, 0]\n";
    let sum = of(&sky.repeat(2));
    let expected = "light: found [2000000000000000.0, 0.0, 0.0], expected each to be 0 or";
    assert!(sum.contains(expected), "{sum}");
    for camera in ["fov_y = 1e-37", "target = [1e30, 0, 0]\nview = \"+x\""] {
        let eye = of(&format!("[camera]\n{camera}"));
        assert!(
            eye.contains("head.toml:1: camera.eye: missing, and"),
            "{eye}"
        );
    }
}

#[test]
fn camera_values_out_of_range() {
    refused(
        r#"
        [camera] / eye = [1, 2, 3] / view = "+x"          => :3: camera.view: found together with eye
        [camera] / eye = [1, 2, 3] / target = [1, 2, 3]   => :2: camera.eye: found the same point as target
        [camera] / eye = [0, 0, 0]                        => :2: camera.eye: found the same point as target
        [camera] / eye = [1, inf, 3]                      => :2: camera.eye: found
        [camera] / eye = [0, 9, 0] / up = [0, 2, 0]       => :3: camera.up: found [0.0, 2.0, 0.0], expected
        [camera] / eye = [0, 9, 0] / up = [0, 0, 0]       => :3: camera.up: found [0.0, 0.0, 0.0], expected
        [camera] / view = "+z" / up = [0, 0, 1]           => :3: camera.up: found [0.0, 0.0, 1.0], expected
        [camera] / up = [0, 0, 0]                         => :2: camera.up: found [0.0, 0.0, 0.0], expected
        [camera] / target = [inf, 0, 0]                   => :2: camera.target: found
        [camera] / fov_y = 0                              => :2: camera.fov_y: found 0, expected
        [camera] / fov_y = 180                            => :2: camera.fov_y: found 180, expected
        [camera] / fov_y = nan                            => :2: camera.fov_y: found NaN, expected
        [camera] / orthographic = 0                       => :2: camera.orthographic: found 0, expected
        [camera] / fov_y = 40 / orthographic = 9          => :3: camera.orthographic: found together with fov_y
        "#,
    );
}

#[test]
fn render_values_out_of_range() {
    refused(
        r#"
        [render] / size = [0, 8]                 => :2: render.size: found [0, 8], expected
        [render] / background = [0, 2, 0]        => :2: render.background: found [0.0, 2.0, 0.0], expected
        [render] / exposure = nan                => :2: render.exposure: found NaN, expected
        [render] / max_bounces = 2 / variant = "caching" => :2: render.max_bounces: found 2, expected 0
        "#,
    );
    assert!(parse("[render]\nmax_bounces = 2").is_ok());
}

#[test]
fn a_program_reads_the_location_from_the_error() {
    let error = parse("[camera]\nfov = 30").expect_err("an unknown key");
    let Error::Input { location, problem } = &error else {
        panic!("{error:?}");
    };
    let file = "scenes/head.toml".to_string();
    assert_eq!(location.origin, Origin::Line { file, line: 2 });
    assert_eq!(location.key.as_deref(), Some("camera.fov"));
    assert_eq!(
        error.to_string(),
        format!("scenes/head.toml:2: camera.fov: {problem}")
    );
}
