//! A render takes up no checkpoint of something else, and writes none in the place of another file.

use crate::Folder;
use crate::refusals::refused;

#[test]
fn a_checkpoint_of_something_else_is_refused() {
    let folder = Folder::new();
    let render = "render ball.toml -o a.exr --checkpoint c.exr";
    folder.succeed(&format!("{render} --variant caching --spp 8"));
    for (flags, expected) in [
        (
            "--variant caching --spp 8 --seed 1",
            "the seed is 0 in c.exr and 1 in this render",
        ),
        (
            "--variant caching --spp 8 --size 8x8",
            "another render: the size is 24x16 in c.exr and 8x8 in this render; --restart",
        ),
        (
            "--variant caching --spp 8 --view=-x",
            "another render: camera.eye.0, which --view and camera.view set as well, is ",
        ),
        // The eye moves back as well, so that the box fills the picture.
        (
            "--variant caching --spp 8 --set camera.fov_y=30",
            "another render: camera.fov_y is 40.0 in c.exr and 30.0 in this render; --restart",
        ),
        (
            "--variant non-caching --spp 8",
            "the variant is caching at scale",
        ),
        ("--variant caching --spp 4", "it has 8 samples, more than 4"),
        (
            "--variant caching --samples 2..16",
            "its first sample is 0, not 2 (--samples)",
        ),
        (
            "--variant caching --spp 8 --orbit 2",
            "it is of 1 pictures, not of 2 (--orbit)",
        ),
    ] {
        let said = refused(&folder, &format!("{render} {flags}"), 3);
        assert!(said.contains(expected), "{flags}: {said}");
        assert!(said.ends_with("; --restart begins anew"), "{said}");
        assert_eq!(said.lines().count(), 1, "{said}");
    }
    let orbit =
        "render ball.toml --size 8x8 -o turn.exr -o turn.png --orbit 2 --checkpoint o.exr --spp";
    folder.succeed(&format!("{orbit} 2"));
    for (flags, expected) in [
        (
            "4",
            "its earlier views end after 2 samples, not after 4 samples",
        ),
        ("2 --time 9", "not after 2 samples or 9 s"),
        (
            "2 --set render.exposure=3",
            "its earlier views are shown with render.exposure 0 and render.tone linear, not with render.exposure 3",
        ),
    ] {
        let said = refused(&folder, &format!("{orbit} {flags}"), 3);
        assert!(said.contains(expected), "{said}");
        assert!(said.ends_with("; --restart begins anew"), "{said}");
    }
    // Radiance has no exposure.
    let radiance = orbit.replace(" -o turn.png", "");
    folder.succeed(&format!("{radiance} 2 --set render.exposure=3"));
    let cached = format!("{render} --variant caching --spp 8");
    // The variant that was picked before stands.
    folder.succeed(&format!("{render} --spp 8"));
    let cache = folder.read("c.exr.cache");
    std::fs::remove_file(folder.path("c.exr.cache")).unwrap();
    let said = refused(&folder, &cached, 3);
    assert!(said.contains("c.exr.cache: it is missing"), "{said}");
    for (at, bit) in [(0, 1), (cache.len() / 2, 4), (cache.len() - 30, 2)] {
        let mut damaged = cache.clone();
        damaged[at] ^= bit;
        folder.write("c.exr.cache", &damaged);
        let said = refused(&folder, &cached, 3);
        assert!(
            said.contains("c.exr.cache: it is damaged; --restart begins anew"),
            "{said}"
        );
    }
    folder.write("c.exr.cache", &cache);
    let whole = folder.read("c.exr");
    folder.succeed("render ball.toml --variant caching --samples 0..8 -o shard.exr");
    let said = refused(&folder, "merge c.exr shard.exr", 3);
    assert!(said.contains("c.exr: it is a checkpoint"), "{said}");
    folder.write("c.exr", &whole[..whole.len() - 9]);
    refused(&folder, &cached, 3);
    // Within the last line of pixels. What is refused stays as it is.
    let mut damaged = whole.clone();
    damaged
        .iter_mut()
        .rev()
        .take(600)
        .for_each(|byte| *byte ^= 1);
    folder.write("c.exr", &damaged);
    let said = refused(&folder, &cached, 3);
    let expected = "its pixels are not those that were written; --restart begins anew";
    assert!(said.ends_with(expected), "{said}");
    assert!(folder.read("c.exr") == damaged);
    folder.write("c.exr", b"");
    let said = refused(&folder, &cached, 3);
    assert!(said.ends_with("; --restart begins anew"), "{said}");
    folder.succeed(&format!("{cached} --restart"));
}

/// Nor does it go where a checkpoint's own files lie.
#[test]
fn a_checkpoint_takes_the_place_of_nothing_else() {
    let folder = Folder::new();
    folder.succeed("render ball.toml -o plain.exr --spp 1");
    folder.succeed("render ball.toml -o shard.exr --samples 0..1");
    let render = "render ball.toml -o a.exr --spp 2";
    for (name, expected) in [
        (
            "plain",
            "it is a picture without a render's state, not a checkpoint",
        ),
        (
            "shard",
            "it is a shard or a merged picture, not a checkpoint",
        ),
    ] {
        let before = folder.read(&format!("{name}.exr"));
        for restart in ["", " --restart"] {
            let said = refused(
                &folder,
                &format!("{render} --checkpoint {name}.exr{restart}"),
                3,
            );
            assert!(said.contains(&format!("{name}.exr: {expected}")), "{said}");
        }
        assert!(folder.read(&format!("{name}.exr")) == before);
    }
    folder.write("c.exr.lock", b"precious");
    let kept = format!("{render} --checkpoint c.exr");
    let said = refused(&folder, &kept, 3);
    assert!(said.contains("c.exr.lock: it is not empty"), "{said}");
    assert_eq!(folder.read("c.exr.lock"), b"precious");
    std::fs::remove_file(folder.path("c.exr.lock")).unwrap();
    for output in ["--stats c.exr.cache", "--profile c.exr.lock"] {
        let said = refused(&folder, &format!("{kept} {output}"), 2);
        assert!(said.contains("two outputs have this name"), "{said}");
    }
}
