//! Scenes: errors that point and teach, well-posedness, and a key reference that cannot drift.

use std::collections::BTreeSet;

use cutis::scene::{KEYS, SceneFile, key_reference};

use crate::common::{get, port, refused, set, sim};

const GOOD: &str = "[mesh.block]\nsize = [0.04, 0.02, 0.02]\ncells = [4, 2, 2]\n[[tissue]]\nE = 1e4\nnu = 0.4\n\
                    [[bone]]\nname = \"skull\"\nnodes = \"x_min\"\n";

#[test]
fn a_bone_may_take_part_of_a_node_set() {
    let sim = sim(&format!("{GOOD}within = [[0, 0, 0], [0, 0.02, 0.01]]\n"));
    let bone = &sim.model().parts().bones[0];
    assert_eq!(bone.nodes.len(), 6);
    assert!(bone.nodes.iter().all(|&a| sim.model().mesh().nodes[a as usize].z < 0.011));
}

#[test]
fn slips_are_answered_with_line_column_and_choices() {
    for (from, to, wanted) in [
        ("nu = 0.4", "lamda = 1", vec!["line 6", "lamda", "nu"]),
        ("nu = 0.4", "nu = 0.5", vec!["line 6, column 6", "nu", "0 <= . < 0.5"]),
        ("E = 1e4", "E = -1.0", vec!["line 5", "-1", "> 0"]),
        ("E = 1e4", "E = nan", vec!["line 5", "NaN"]),
        ("E = 1e4", "E = 1e4\nenergy = \"neohookean\"", vec!["line 6", "neohookean", "stable-neo-hookean"]),
        ("nu = 0.4", "c10 = 0.4", vec!["line 6", "`c10` is no constant of `polyconvex-neo-hookean`", "`E`, `nu`"]),
        ("nu = 0.4", "nu = 0.4\nenergy = \"mass-spring\"", vec!["line 6", "takes `E` alone, not `nu`"]),
        ("E = 1e4\nnu = 0.4", "energy = \"mass-spring\"", vec!["`E`, which is missing"]),
        ("nu = 0.4", "energy = \"yeoh\"", vec!["`E` is no constant of `yeoh`"]),
        ("E = 1e4\nnu = 0.4", "energy = \"yeoh\"\nc10 = 1.0", vec!["`c20` is missing"]),
        ("\"x_min\"", "\"x_min\"\nwithin = [[0, 0, 1], [1, 1, 0]]", vec!["line 10, column 10", "smallest corner"]),
        (
            "\"x_min\"",
            "\"x_min\"\nwithin = [[1, 1, 1], [2, 2, 2]]",
            vec!["line 10, column 10", "no node of bone `skull`"],
        ),
        ("\"x_min\"", "\"xmin\"", vec!["line 9", "unknown node set `xmin`", "x_min"]),
        ("[[bone]]", "[[bone]]\nname = \"a\"\nnodes = \"x_min\"\n[[bone]]", vec!["claim node"]),
        ("cells = [4, 2, 2]", "cells = [4, 0, 2]", vec!["line 3", ">= 1"]),
        ("[mesh.block]", "[mesh]\nfile = \"a.msh\"\n[mesh.block]", vec!["exactly one"]),
        ("[mesh.block]", "[mesh]\ncurved = true\n[mesh.block]", vec!["line 2, column 10", "order = 2"]),
        ("[[tissue]]", "[[tissue]]\nregions = [\"fat\"]", vec!["unknown region `fat`", "tissue"]),
        (
            "[[bone]]",
            "[[keyframe]]\nt = 1.0\nport = \"bone.pose\"\nvalue = 1.0\n[[bone]]",
            vec!["bone.pose", "bone.translation"],
        ),
        (
            "[[bone]]",
            "[[keyframe]]\nt = 1.0\nport = \"bone.rotation\"\nrow = \"jaw\"\nvalue = 1.0\n[[bone]]",
            vec!["jaw", "skull"],
        ),
        ("[[bone]]", "[[load]]\nname = \"a\"\n[[bone]]", vec!["needs either `at`"]),
    ] {
        let message = refused(&GOOD.replacen(from, to, 1));
        for part in wanted {
            assert!(message.contains(part), "`{part}` is missing from:\n{message}");
        }
    }
}

/// What a component is made of is the scene itself: mesh, elements, everything that the token hashes.
#[test]
fn a_packed_scene_is_the_scene() {
    for name in ["curved", "order_2", "layers", "skin"] {
        let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/scenes/").to_owned() + name + ".toml";
        let scene = std::path::Path::new(&scene);
        let plain = cutis::load::from_file(scene).expect("a scene").model;
        let packed = cutis::load::baked(scene).and_then(|b| b.load()).expect("a packed scene").model;
        assert_eq!(packed.token(), plain.token(), "{name}");
    }
}

#[test]
fn loose_tissue_is_named() {
    let message = refused(&GOOD[..GOOD.find("[[bone]]").unwrap()]);
    assert!(message.contains("held by no bone") && message.contains("45 nodes"), "{message}");
}

#[test]
fn a_bone_takes_only_the_inputs_of_its_drive() {
    let mut sim = sim(&GOOD.replace(
        "nodes = \"x_min\"",
        "nodes = \"x_min\"\ndrive = \"held\"\n[[bone]]\nname = \"jaw\"\nnodes = \"x_max\"",
    ));
    let translation = port(&sim, "bone.translation");
    let message = sim.set_f64(translation, 0, &[0.0, 0.0, 1e-3]).unwrap_err().to_string();
    assert!(message.contains("bone.translation[1,3]") && message.contains("`skull` is held"), "{message}");
    sim.step(0.1).expect("nothing was set");
    set(&mut sim, "bone.translation", 0, &[0.0, 0.0, 0.0, 1e-3, 0.0, 0.0]);
    sim.step(0.1).expect("the jaw is driven");
    assert!(get(&sim, "bone.reactionForce")[3] < 0.0);
}

#[test]
fn an_osteotomy_line_is_seen_and_can_be_released() {
    let text = GOOD.replace("[[bone]]\nname", "[[bone]]\nname = \"front\"\nnodes = \"y_min\"\n[[bone]]\nname");
    let message = refused(&text);
    assert!(message.contains("both claim"), "{message}");
    // Two bones side by side on the bottom: a gap of one edge between x_min and the rest.
    let two = "[mesh.block]\nsize = [0.02, 0.02, 0.02]\ncells = [1, 2, 2]\n[[tissue]]\nE = 1e4\nnu = 0.4\n\
               [[bone]]\nname = \"a\"\nnodes = \"x_min\"\n[[bone]]\nname = \"b\"\nnodes = \"x_max\"\n";
    let mut tight = sim(two);
    assert!(tight.model().warnings().iter().any(|w| w.contains("free_rings")), "{:?}", tight.model().warnings());
    set(&mut tight, "bone.translation", 3, &[0.008, 0.0, 0.0]);
    let report = tight.step(0.1).expect("a jump");
    assert!(report.warnings.iter().any(|w| w.contains("free_rings")), "{report:?}");
    let message = refused(&format!("{two}[attachment]\nfree_rings = 1\n"));
    assert!(message.contains("held by no bone"), "all nodes of so small a block are released: {message}");
}

/// Keys that serde accepts in a table, read off its own message about an unknown one.
fn accepted(table: &str) -> BTreeSet<String> {
    let probe = match table {
        "" => "no_such_key = 1\n".to_owned(),
        _ if table.starts_with("tissue.") => format!("[[tissue]]\n[{table}]\nno_such_key = 1\n"),
        "tissue" | "bone" | "muscle" | "load" | "pressure" | "contact" | "marker" | "keyframe" => {
            format!("[[{table}]]\nno_such_key = 1\n")
        }
        _ => format!("[{table}]\nno_such_key = 1\n"),
    };
    let message = SceneFile::parse(&probe).unwrap_err().to_string();
    let list = message.split("expected").nth(1).unwrap_or_else(|| panic!("no choices in: {message}"));
    list.split('`').skip(1).step_by(2).map(str::to_owned).collect()
}

#[test]
fn every_key_is_documented_and_every_documented_key_exists() {
    for table in cutis::scene::tables() {
        let documented: BTreeSet<String> =
            KEYS.iter().filter(|k| k.table == table).map(|k| k.name.to_owned()).collect();
        assert_eq!(documented, accepted(table), "table [{table}]");
    }
    let key = KEYS.iter().find(|k| k.table == "tissue" && k.name == "energy").expect("documented");
    let cutis::scene::Range::OneOf(choices) = key.range else { panic!("energies are chosen by name") };
    let laws = cutis::effect::LAWS.iter().map(|l| l.name);
    assert_eq!(choices, laws.chain(["mass-spring"]).collect::<Vec<_>>());
}

#[test]
fn the_key_reference_in_docs_is_up_to_date() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/scene.md");
    let head = "# Scene reference\n\nOne TOML file says what is simulated; only what stands in it exists at run time. All numbers are SI. Unknown keys are\nrefused with line, column and choices. This page is generated from `src/scene/keys.rs` (`BLESS=1 cargo test --release`).\n\n";
    let wanted = format!("{head}{}", key_reference()).trim_end().to_owned() + "\n";
    if std::env::var_os("BLESS").is_some() {
        std::fs::write(path, &wanted).expect("docs/scene.md can be written");
    }
    let found = std::fs::read_to_string(path).unwrap_or_default();
    assert!(found == wanted, "docs/scene.md has drifted: run BLESS=1 cargo test --release");
}

/// Two bones side by side in a fine block: each further ring frees more.
/// A bone that a force drives turns about the line of its nodes with nothing to hold it, whether it has a mass or not.
#[test]
fn a_bone_that_a_force_drives_is_no_line() {
    let scene = |within: &str, inertia: &str| {
        format!("{GOOD}[[bone]]\nname = \"jaw\"\nnodes = \"x_max\"\ndrive = \"force\"\nwithin = {within}\n{inertia}")
    };
    for inertia in ["", "[inertia]\n"] {
        let message = refused(&scene("[[0, 0, 0], [1, 0, 0.011]]", inertia));
        for part in ["line 11, column 8", "bone `jaw`", "2 node(s)", "inertia tensor is singular", "at least 3 nodes"] {
            assert!(message.contains(part), "`{part}`: {message}");
        }
        sim(&scene("[[0, 0, 0], [1, 0.011, 0.011]]", inertia)).initialise().expect("three corners and a middle");
    }
}

#[test]
fn a_region_is_made_of_one_tissue() {
    let twice = GOOD
        .replace("[[bone]]", "regions = [\"tissue\"]\n[[tissue]]\nregions = [\"tissue\"]\nE = 2e4\nnu = 0.4\n[[bone]]");
    let message = refused(&twice);
    assert!(
        message.contains("line 9") && message.contains("region `tissue` is made of another [[tissue]]"),
        "{message}"
    );
}

#[test]
fn each_ring_frees_more() {
    let scene = |from: f64, rings: u32| {
        format!(
            "[mesh.block]\nsize = [0.06, 0.03, 0.01]\ncells = [24, 6, 2]\n[[tissue]]\nE = 1e4\nnu = 0.4\n[[bone]]\nname = \"left\"\n\
             nodes = \"z_min\"\nwithin = [[-1, -1, -1], [0.0301, 1, 1]]\n[[bone]]\nname = \"right\"\nnodes = \"z_min\"\nwithin = \
             [[{from}, -1, -1], [1, 1, 1]]\n[attachment]\nfree_rings = {rings}\n"
        )
    };
    let held =
        |from, rings| sim(&scene(from, rings)).model().parts().bones.iter().map(|b| b.nodes.len()).sum::<usize>();
    // A ring of a straight line is a row of 7 nodes on each side, of 25 rows in all.
    for rings in [0, 1, 2, 3, 6] {
        assert_eq!(held(0.0302, rings as u32), 7 * (25 - 2 * rings), "{rings} rings");
    }
    // Three rows that both claim are the border.
    for rings in [1, 2, 3, 6] {
        assert_eq!(held(0.0249, rings as u32), 7 * (22 - 2 * rings), "{rings} rings about shared rows");
    }
}

#[test]
fn values_beyond_sense_are_told() {
    let block = "[mesh.block]\nsize = [0.06, 0.04, 0.02]\ncells = [6, 4, 2]\n[[tissue]]\nE = 15e3\nnu = 0.45\n[[bone]]\nname = \"skull\"\n\
                 nodes = \"x_min\"\ndrive = \"held\"\n[[bone]]\nname = \"jaw\"\nnodes = \"x_max\"\n";
    let told = |scene: &str| sim(scene).model().warnings().join("\n");
    assert_eq!(told(block), "");
    for (scene, wanted) in [
        (block.replace("15e3", "15"), "kilopascals"),
        (format!("{block}rotation = [8, 0, 0]\n"), "degrees"),
        (format!("{block}translation = [5, 0, 0]\n"), "metres are wanted"),
        (format!("{block}[[marker]]\nname = \"far\"\nat = [0.03, 0.02, 0.05]\n"), "30.0 mm from the skin"),
        (
            format!("{block}[[keyframe]]\nt = 1.0\nport = \"bone.rotation\"\nrow = \"jaw\"\nvalue = [0, 10, 0]\n"),
            "keyframe of `bone.rotation` of `jaw` at t = 1 s is 10.000 rad",
        ),
        (
            format!("{block}[[keyframe]]\nt = 9.0\nport = \"bone.rotation\"\nrow = \"jaw\"\nvalue = [0, 0.1, 0]\n"),
            "after the end of [run]",
        ),
        (
            block.replace("[[bone]]\nname = \"skull\"", "[[tissue]]\nE = 1e3\nnu = 0.4\n[[bone]]\nname = \"skull\""),
            "[[tissue]] 2 of 2 makes no region",
        ),
    ] {
        assert!(told(&scene).contains(wanted), "{wanted}: {}", told(&scene));
    }
    let message = refused(&format!(
        "{block}[[muscle]]\nname = \"m\"\npath = [[0, 0.02, 0.01], [0.06, 0.02, 0.01]]\nradius = 0.02\n[[keyframe]]\nt = 1.0\n\
         port = \"muscle.activation\"\nvalue = [1.5]\n"
    ));
    assert!(message.contains("1.5") && message.contains("0 to 1"), "{message}");
}

/// What a host could not set, a scene cannot start with or come to.
#[test]
fn starts_and_keyframes_keep_to_the_range_of_their_input() {
    let block = "[mesh.block]\nsize = [0.06, 0.04, 0.02]\ncells = [3, 2, 2]\n[[tissue]]\nE = 15e3\nnu = 0.45\n[[bone]]\nname = \"skull\"\n\
                 nodes = \"x_min\"\ndrive = \"held\"\n[[bone]]\nname = \"jaw\"\nnodes = \"x_max\"\n";
    let frame = |port: &str, row: &str, value: &str| {
        format!("{block}[[keyframe]]\nt = 1.0\nport = \"{port}\"\nrow = \"{row}\"\nvalue = {value}\n")
    };
    for (scene, wanted) in [
        (format!("{block}rotation = [0, 0, 1000]\n"), "`bone.rotation` of `jaw` starts at 1000 rad"),
        (format!("{block}[gravity]\nacceleration = [0, 0, -98100000]\n"), "`gravity` starts at -98100000"),
        (frame("bone.translation", "skull", "[0, 0, 0.01]"), "bone `skull` cannot be set: its `drive` is not \"pose\""),
        (
            format!(
                "{}{}",
                frame("bone.rotation", "jaw", "[0, 0, 0.1]"),
                &frame("bone.rotation", "jaw", "[0, 0, 0.2]")[block.len()..]
            ),
            "two keyframes give `bone.rotation` values at t = 1 s",
        ),
        (
            format!(
                "{}[[keyframe]]\nt = 0.5\nport = \"bone.rotation\"\nvalue = [0, 0, 0, 0, 0, 0.2]\n",
                frame("bone.rotation", "jaw", "[0, 0, 0.1]")
            ),
            "with and without `row`",
        ),
        (format!("{block}pivot = [nan, 0, 0]\n"), "wanted a finite number"),
        (frame("solver.mostSolves", "jaw", "3"), "unknown input `solver.mostSolves`"),
    ] {
        let message = refused(&scene);
        assert!(message.contains(wanted), "{wanted}: {message}");
    }
    sim(&frame("bone.translation", "skull", "[0, 0, 0]"));
}

#[test]
fn presets_choose_the_element_that_they_need() {
    let names: Vec<&String> = cutis::scene::presets().keys().collect();
    for order in [1, 2] {
        for name in &names {
            let scene = format!(
                "[mesh]\norder = {order}\n[mesh.block]\nsize = [0.06, 0.04, 0.02]\ncells = [3, 2, 2]\n[[tissue]]\npreset = \"{name}\"\n[[bone]]\nname = \
                 \"skull\"\nnodes = \"x_min\"\ndrive = \"held\"\n"
            );
            assert_eq!(sim(&scene).model().warnings(), &[] as &[String], "{name}, order {order}");
        }
    }
}

/// k dt, not a sum; the last step is the shorter one.
#[test]
fn programmes_end_where_they_say() {
    let programme = |dt: &str, end: &str| {
        let scene = format!(
            "[mesh.block]\nsize = [0.06, 0.04, 0.02]\ncells = [3, 2, 2]\n[[tissue]]\nE = 1e4\nnu = 0.4\n[[bone]]\nname = \"a\"\nnodes = \
             \"x_min\"\n[run]\ndt = {dt}\nend = {end}\n"
        );
        cutis::load::from_text(&scene, None).expect("a scene").programme
    };
    let p = programme("0.3", "1.0");
    let close = |a: f64, b: f64| (a - b).abs() < 1e-15;
    assert_eq!((p.steps(), p.time(1), p.time(3), p.time(4)), (4, 0.3, 3.0 * 0.3, 1.0));
    assert!(close(p.step(3), 0.3) && close(p.step(4), 0.1), "{} {}", p.step(3), p.step(4));
    for (dt, end, n) in
        [("0.1", "1.0", 10), ("0.1", "0.7", 7), ("0.125", "1.0", 8), ("1e-3", "3.0", 3000), ("2.0", "1.0", 1)]
    {
        let p = programme(dt, end);
        assert_eq!(p.steps(), n, "{dt} to {end}");
        assert!((1..n).all(|k| p.step(k) == p.dt) && p.time(n) == p.end);
        assert!(n == 1 || p.step(n) == p.dt, "{dt} to {end}: the last step is {}", p.step(n));
    }
}

/// No word of the parser's own types.
#[test]
fn errors_of_the_parser_are_put_plainly() {
    for (from, to, wanted) in [
        ("E = 1e4", "E = \"soft\"", "wanted a number"),
        ("E = 1e4", "E = true", "wanted a number"),
        ("size = [0.04, 0.02, 0.02]", "size = 3", "wanted an array"),
        ("size = [0.04, 0.02, 0.02]", "size = [0.04, 0.02]", "wanted an array of 3"),
        ("size = [0.04, 0.02, 0.02]", "size = [\"a\", 0.02, 0.1]", "wanted a number"),
        ("name = \"skull\"", "name = 3", "wanted text in quotes"),
        ("[mesh.block]", "[[mesh.block]]", "wanted a"),
        ("cells = [4, 2, 2]", "cells = [4.5, 2, 2]", "wanted a whole number"),
        (GOOD, "[[tissue]]\nE = 1e4\n", "line 1, column 1: the scene lacks the table [mesh]"),
        ("cells = [4, 2, 2]\n", "", "line 1, column 1: [mesh.block] lacks `cells`"),
        ("name = \"skull\"\n", "", "line 7, column 1: [[bone]] lacks `name`"),
        ("name = \"skull\"", "name = \"skull\"\ncolour = 3", "line 9, column 1: unknown key `colour`"),
        ("nu = 0.4", "nu = ", "line 6, column "),
    ] {
        let message = refused(&GOOD.replace(from, to));
        let own = [
            "expected a ",
            "missing field",
            "unknown field",
            "parse error",
            "untagged",
            "struct",
            "enum",
            "invalid type",
            "f64",
            "u32",
            "usize",
            "sequence",
        ];
        assert!(message.contains(wanted), "{to}: {message}");
        assert!(!own.iter().any(|word| message.contains(word)), "{to}: {message}");
    }
}
