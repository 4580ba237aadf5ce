//! `cutis bake` as a user runs it: settings beside the scan, hints on the line, labels out and in again, words about doubts.
use std::path::Path;
use std::process::Command;

use super::heads::MM;
use super::phantom::Phantom;
use super::storage::write;

/// Whether it ended well, and what it wrote to both streams.
fn bake(scan: &Path, more: &[&str]) -> (bool, String) {
    let out = scan.with_extension("cutis");
    let mut command = Command::new(env!("CARGO_BIN_EXE_cutis"));
    command.arg("bake").arg(scan).args(["--edge", "9", "-o"]).arg(&out).args(more);
    let done = command.output().unwrap();
    let text = [done.stdout, done.stderr].map(|b| String::from_utf8(b).unwrap()).concat();
    (done.status.success(), text)
}

#[test]
fn settings_hints_and_labels_of_the_command_line_in_release() {
    let head = Phantom { bite: 2.0, spacing: [2.0; 3], ..Phantom::default() }.head();
    let scan = write(&head.volume, "bake_command.nrrd", false);
    let folder = scan.parent().unwrap().join("bake_command");
    std::fs::create_dir_all(&folder).unwrap();
    let moved = folder.join("head.nrrd");
    std::fs::rename(&scan, &moved).unwrap();
    let settings = folder.join("bake.toml");
    let labels = folder.join("labels.nii.gz");
    let _ = std::fs::remove_file(&settings);

    let (good, plain) = bake(&moved, &["--write-labels", labels.to_str().unwrap()]);
    assert!(good && plain.contains("pivot = ") && plain.contains("bone mandible"), "{plain}");
    assert!(!plain.contains("not to be trusted") && !plain.contains("settings from"), "{plain}");
    let (good, again) = bake(&moved, &["-l", labels.to_str().unwrap()]);
    assert!(good && again.contains("pivot = ") && !again.contains("do the labels"), "{again}");
    // The same bone, but for where edges were collapsed at ties.
    let nodes = |text: &str| {
        let line = text.lines().find(|l| l.starts_with("bone mandible")).expect("the mandible was found");
        line.split_whitespace().nth(2).and_then(|n| n.parse::<f64>().ok()).expect("a number of nodes")
    };
    assert!((nodes(&again) / nodes(&plain) - 1.0).abs() < 0.05, "{plain}{again}");

    std::fs::write(&settings, "hinge = [[-40, 10, 20], [40, 10, 20]]\n[seeds]\nmandible = [[0, -76, -70]]\n").unwrap();
    let (good, text) = bake(&moved, &[]);
    assert!(good && text.contains("settings from") && text.contains("pivot = [0.0000, 0.0100, 0.0200]"), "{text}");
    let (good, text) = bake(&moved, &["--hinge", "-40", "0", "2", "40", "0", "2"]);
    assert!(good && text.contains("pivot = [0.0000, 0.0000, 0.0020]"), "{text}");
    for (content, wanted) in [
        ("hinges = 1\n", "unknown field `hinges`"),
        ("[seeds]\njaw = [[0, 0, 0]]\n", "unknown bone `jaw`"),
        ("hinge = [[0, 0], [1, 1]]\n", "array of length 3"),
        ("occlusal = { point = [0, 0, 0], normal = [0, 0, 0] }\n", "the normal is 0"),
        ("[seeds]\nmandible = [[0, -40, -60]]\n", "no bone is within 3 mm"),
        ("skin = nan\n", "skin"),
    ] {
        std::fs::write(&settings, content).unwrap();
        let (good, text) = bake(&moved, &[]);
        assert!(!good && text.contains(wanted), "{content}: {text}");
    }
    std::fs::remove_file(&settings).unwrap();
    let (good, text) = bake(&moved, &["--seed", "mandible=0,-76"]);
    assert!(!good && text.contains("mandible=-22,-82,-80"), "{text}");
    let (good, text) = bake(&moved, &["--write-labels", "labels.nrrd"]);
    assert!(!good && text.contains(".nii.gz"), "{text}");
    let (good, text) = bake(&moved, &["--seed", "skull=0,-70,20", "-l", labels.to_str().unwrap()]);
    assert!(!good && text.contains("mend them instead"), "{text}");

    // A head whose chin is not in the scan: told with value and limit, or refused where that is asked.
    let [low, high] = head.volume.grid.bounds();
    let none = head.cut(nalgebra::Vector3::new(low.x, low.y, -30.0 * MM), high);
    std::fs::rename(write(&none.volume, "bake_command.nrrd", false), &moved).unwrap();
    let (good, text) = bake(&moved, &[]);
    assert!(
        good && text.contains("not to be trusted") && text.contains("wanted") && !text.contains("bone mandible"),
        "{text}"
    );
    assert!(!text.contains("pivot") && text.contains("--seed"), "{text}");
    let (good, text) = bake(&moved, &["--strict"]);
    assert!(!good && text.contains("doubtful"), "{text}");
}
