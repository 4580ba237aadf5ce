//! Bones, hinge and checks over a family of heads: what is found is right, what cannot be is told.
use cutis::geometry::anatomy::{About, Anatomy, Hints, anatomy};
use cutis::geometry::{BakeOptions, Grid, Labels, MeshingError, Resolution, Volume, Warning, bake};
use cutis::io::{LabelMap, read_labels, read_volume};
use cutis::math::{Mat3, Vec3};

use super::ct_files::data;
use super::heads::{Head, MANDIBLE, MM, points, score, without_islands};
use super::phantom::{HYOID, MOUTH, Phantom, oblique};

const THRESHOLDS: [f64; 2] = [-300.0, 250.0];
const BONE: f64 = THRESHOLDS[1];

fn found(head: &Head, hints: &Hints) -> Option<Anatomy> {
    anatomy(&head.volume.upright(), None, THRESHOLDS, hints)
}

/// How far each condyle and their middle are off, m.
fn off(found: &Anatomy, head: &Head) -> [f64; 3] {
    let [Some(right), Some(left)] = found.condyles else { return [f64::INFINITY; 3] };
    let middle = 0.5 * (right + left - head.condyles[0] - head.condyles[1]);
    [(right - head.condyles[0]).norm(), (left - head.condyles[1]).norm(), middle.norm()]
}

fn doubts(found: &Anatomy, about: About) -> Vec<String> {
    found.doubts(about).map(ToString::to_string).collect()
}

/// Bones and hinge are right and believed.
fn right(head: &Head, what: &str) -> Anatomy {
    let found = found(head, &Hints::default()).unwrap_or_else(|| panic!("{what}: nothing found"));
    let (s, [r, l, m]) = (score(&found.labels, head, BONE), off(&found, head).map(|d| d / MM));
    println!("{what:20} {s}, hinge {r:.1} {l:.1}, middle {m:.1} mm");
    for about in [About::Bones, About::Hinge] {
        assert!(doubts(&found, about).is_empty(), "{what}: {:?}", doubts(&found, about));
    }
    assert!(s.both >= 0.98 && s.surface >= 0.975, "{what}: {s}");
    assert!(r.max(l) <= 5.0 && m <= 3.0, "{what}: {r} {l} {m}");
    found
}

/// A mesh of large errors, which says as much of bones as a fine one.
fn coarse() -> Resolution {
    Resolution { edge: 9e-3, skin_error: Some(0.4 * MM), bone_error: Some(1.0 * MM), ..Resolution::default() }
}

#[test]
fn phantoms_come_apart_in_release() {
    let plain = Phantom { bite: 2.0, ..Phantom::default() };
    let head = plain.head();
    let whole = right(&head, "gap of 2 mm");
    let hyoid = |labels: &Labels| labels.ids.iter().filter(|&&id| id == HYOID).count() as f64;
    assert!((hyoid(&whole.labels) / hyoid(&head.labels) - 1.0).abs() < 0.5);
    assert_eq!(found(&head, &Hints::default()).unwrap(), whole, "the same bits each time");
    for axis in 0..3 {
        right(&head.turned(axis, 25.0), &format!("turned about {axis}"));
        right(&oblique(&head, axis, -15.0), &format!("oblique about {axis}"));
    }
    right(&head.opened(12.0), "mouth open");
    right(&head.streaked(3, 3), "streaks");
    for (what, phantom) in [
        ("teeth in contact", Phantom { bite: 0.0, ..plain }),
        ("teeth in contact, thick slices", Phantom { bite: 0.0, spacing: [1.0, 1.0, 5.0], ..plain }),
        ("joints of 1 mm", Phantom { joint: 1.0, ..plain }),
        ("no teeth", Phantom { teeth: 0, ..plain }),
        ("small", Phantom { size: 0.84, ..plain }),
        ("large", Phantom { size: 1.15, ..plain }),
        ("steep angle", Phantom { steep: 6.0, ..plain }),
        ("flat angle", Phantom { steep: -6.0, ..plain }),
        ("no air in the ears", Phantom { ears: false, ..plain }),
        ("noise", Phantom { noise: 60.0, ..plain }),
        ("thick slices", Phantom { spacing: [1.0, 1.0, 3.0], ..plain }),
    ] {
        right(&phantom.head(), what);
    }
}

/// A wrong answer is worse than none: fields without chin or joints.
#[test]
fn what_is_not_in_the_field_is_told_in_release() {
    let head = Phantom { bite: 2.0, ..Phantom::default() }.head();
    let [low, high] = head.volume.grid.bounds();
    let none = head.cut(Vec3::new(low.x, low.y, -30.0 * MM), high);
    assert!(found(&none, &Hints::default()).is_none_or(|a| !doubts(&a, About::Bones).is_empty()));
    for top in [-6.0, -10.0, -14.0] {
        let cut = head.cut(low, Vec3::new(high.x, high.y, top * MM));
        let found = found(&cut, &Hints::default()).unwrap();
        assert!(!doubts(&found, About::Hinge).is_empty());
        assert!(score(&found.labels, &cut, BONE).both > 0.98 || !doubts(&found, About::Bones).is_empty());
    }
}

/// The project's CT head with its labels.
fn scan(name: &str) -> Option<Head> {
    let (Some(scan), Some(labels)) = (data(name), data("cthead_unc_labels.nii.gz")) else { return None };
    let volume = read_volume(&scan, &mut Vec::new()).unwrap();
    let labels = read_labels(&labels, &LabelMap::default(), &mut Vec::new()).unwrap();
    // Read off the scan by index.
    let condyles = [Vec3::new(51.0, 111.0, 49.0), Vec3::new(157.0, 116.0, 51.0)].map(|c| labels.grid.world(&c));
    let mut head = Head { volume, labels, condyles }.cubes(1.5 * MM);
    without_islands(&mut head, BONE);
    Some(head)
}

#[test]
fn scanned_head_comes_apart_in_release() {
    let Some(head) = scan("cthead_unc.nii.gz") else { return };
    right(&head, "as published");
    right(&head.turned(0, 25.0), "turned");
    right(&head.turned(0, -20.0).turned(1, 20.0), "turned twice");
    right(&head.mirrored(), "mirrored");
    right(&head.slices(5.0 * MM), "slices of 5 mm");
    right(&head.noisy(96.0), "noise of 96 HU");
    right(&head.scaled(0.82), "small");
    right(&head.scaled(1.15), "large");
    right(&head.opened(18.0), "open by 18 degrees");
    right(&head.opened(-4.0), "closed by 4 degrees");
    let [low, high] = head.volume.grid.bounds();
    let [chin, _] = head.jaw_box();
    let hinge = 0.5 * (head.condyles[0] + head.condyles[1]);
    right(&head.cut(Vec3::new(low.x, low.y, chin.z - 4.0 * MM), high), "cut below the chin");
    right(&head.cut(low, Vec3::new(high.x, high.y, hinge.z + 8.0 * MM)), "cut over the hinge");
    let cut = head.cut(low, Vec3::new(high.x, high.y, hinge.z - 8.0 * MM));
    let below = found(&cut, &Hints::default()).unwrap();
    assert!(doubts(&below, About::Bones).is_empty() && !doubts(&below, About::Hinge).is_empty());
    assert!(score(&below.labels, &cut, BONE).both > 0.98);
    let Some(clean) = scan("cthead_unc_clean.nii.gz") else { return };
    right(&clean, "streaks removed");
}

/// What a user knows of a head is taken: seeds, bite, hinge; what would do nothing is refused.
#[test]
fn hints_are_taken_in_release() {
    let head = Phantom { bite: 2.0, ..Phantom::default() }.head();
    let plain = BakeOptions { resolution: coarse(), ..BakeOptions::default() };
    let with = |hints: Hints| bake(&head.volume, None, &BakeOptions { hints, ..plain.clone() }, &mut |_, _| {});
    // A seed in the upper jaw's bone claims what it lies in.
    let place = Vec3::new(46.0, -58.0, -3.0) * MM;
    let label = |hints: &Hints| found(&head, hints).unwrap().labels.at(&place);
    let seeds = vec![("spine".to_owned(), place)];
    assert_eq!((label(&Hints::default()), label(&Hints { seeds, ..Hints::default() })), (2, 4));
    // A bite given 6 mm too high gives the upper crowns to the mandible.
    let normal = Vec3::new(0.0, -5.0, 60.0).normalize();
    let bite = |up: f64| {
        let occlusal = Some([Vec3::new(0.0, -76.0, -38.0 + up) * MM, normal]);
        score(&found(&head, &Hints { occlusal, ..Hints::default() }).unwrap().labels, &head, BONE)
    };
    let (right, high) = (bite(0.0), bite(6.0));
    println!("bite given right: {right}; 6 mm too high: {high}");
    assert!(right.both > 0.99 && high.rest < right.rest - 0.01);
    let hinge = Some([Vec3::new(-50.0, 1.0, 1.0) * MM, Vec3::new(52.0, 1.0, 1.0) * MM]);
    assert_eq!(with(Hints { hinge, ..Hints::default() }).unwrap().condyles, hinge);
    let commissures = Some([Vec3::new(-30.0, -90.0, -38.0) * MM, Vec3::new(28.0, -90.0, -38.0) * MM]);
    let mouth = with(Hints { commissures, ..Hints::default() }).unwrap().mouth.unwrap();
    assert_eq!([mouth[0].x, mouth[1].x], [-30.0 * MM, 28.0 * MM]);
    for (bone, place, why) in [
        ("mandible", [0.0, -50.0, -60.0], "no bone"),
        ("mandible", [0.0, 500.0, 0.0], "outside"),
        ("jaw", [0.0, -76.0, -75.0], "known are"),
    ] {
        let seeds = vec![(bone.to_owned(), Vec3::from(place) * MM)];
        let e = with(Hints { seeds, ..Hints::default() }).unwrap_err();
        assert!(matches!(e, MeshingError::Seed { .. }) && e.to_string().contains(why), "{e}");
    }
}

/// Where no mandible's shape is found, seeds of both jaws tell the bones apart, and a strict baking refuses.
#[test]
fn seeds_alone_part_what_looks_like_no_jaw() {
    let n = 72;
    let grid = Grid {
        dims: [n, n, n],
        spacing: Vec3::repeat(2.0 * MM),
        origin: Vec3::repeat(-71.0 * MM),
        direction: Mat3::identity(),
    };
    let samples = points(&grid).map(|p| {
        let p = p / MM;
        let ball = |c: [f64; 3], r: f64| (p - Vec3::from(c)).norm() - r;
        let bone = ball([0.0, 10.0, 22.0], 26.0).min(ball([0.0, -10.0, -30.0], 14.0));
        let skin = ball([0.0, 0.0, 0.0], 64.0);
        if bone < 0.0 {
            900.0
        } else if skin < 0.0 {
            40.0
        } else {
            -1000.0
        }
    });
    let volume = Volume { samples: samples.collect(), grid };
    let plain = BakeOptions { resolution: coarse(), ..BakeOptions::default() };
    let run = |options: &BakeOptions| bake(&volume, None, options, &mut |_, _| {});
    let none = run(&plain).unwrap();
    assert!(none.warnings.contains(&Warning::JawNotFound) && none.finest.mesh.node_set("mandible").is_none());
    assert!(matches!(run(&BakeOptions { strict: true, ..plain.clone() }), Err(MeshingError::Doubtful { .. })));
    let seed = |bone: &str, z: f64, y: f64| (bone.to_owned(), Vec3::new(0.0, y, z) * MM);
    let hints = Hints { seeds: vec![seed("skull", 22.0, 10.0), seed("mandible", -30.0, -10.0)], ..Hints::default() };
    let parted = run(&BakeOptions { hints, ..plain }).unwrap();
    let jaw = parted.finest.mesh.node_set("mandible").unwrap();
    assert!(jaw.nodes.iter().all(|&a| parted.finest.mesh.nodes[a as usize].z < -10.0 * MM));
    assert!(parted.warnings.iter().any(|w| matches!(w, Warning::Bones { given: true, .. })));
}

/// The lips' line from corner to corner, and what is said where there is none.
#[test]
fn lips_are_found_in_release() {
    let phantom = Phantom { spacing: [1.0, 1.0, 1.0], ..Phantom::default() };
    let head = phantom.head();
    let found_in = |head: &Head| found(head, &Hints::default()).unwrap();
    let seen = found_in(&head);
    assert!(doubts(&seen, About::Mouth).is_empty(), "{:?}", doubts(&seen, About::Mouth));
    let [right, left] = seen.lips.commissures().map(|c| c / MM);
    println!("commissures {:.1?} {:.1?}", right.as_slice(), left.as_slice());
    assert!((right.x + MOUTH).abs() < 1.5 && (left.x - MOUTH).abs() < 1.5);
    assert!(seen.lips.line.iter().all(|p| (p.z / MM + 38.0).abs() < 1.0));
    let tip = seen.nose.unwrap() / MM;
    assert!((tip - Vec3::new(0.0, -114.5, -12.0)).norm() < 2.0, "{tip}");
    let turned = head.turned(0, 25.0);
    let seen = found_in(&turned);
    assert!(doubts(&seen, About::Mouth).is_empty());
    let wide = (seen.lips.commissures()[1] - seen.lips.commissures()[0]).norm() / MM;
    assert!((wide - 2.0 * MOUTH).abs() < 3.0, "{wide}");
    // Lips that nothing parts are not made up.
    let mut closed = head.clone();
    for (p, s) in points(&head.volume.grid).zip(&mut closed.volume.samples) {
        if p.x.abs() < 27.0 * MM && p.y < -82.0 * MM && (p.z + 38.0 * MM).abs() < 2.5 * MM && p.y > -97.0 * MM {
            *s = 40.0;
        }
    }
    assert!(!doubts(&found_in(&closed), About::Mouth).is_empty());
}

/// Labels that are wrong are told by the same checks; right ones are not.
#[test]
fn wrong_labels_are_doubted_in_release() {
    let head = Phantom { bite: 2.0, ..Phantom::default() }.head();
    let judged = |labels: &Labels| anatomy(&head.volume, Some(labels), THRESHOLDS, &Hints::default());
    let truth = judged(&head.labels).unwrap();
    assert!(truth.checks.iter().all(|c| c.holds()), "{:?}", truth.checks);
    assert!(off(&truth, &head)[0].max(off(&truth, &head)[1]) < 5.0 * MM);
    let points: Vec<Vec3> = super::heads::points(&head.labels.grid).map(|p| p / MM).collect();
    let changed = |change: &dyn Fn(&Vec3, u8) -> u8| {
        let ids = points.iter().zip(&head.labels.ids).map(|(p, &id)| change(p, id)).collect();
        Labels { ids, ..head.labels.clone() }
    };
    let doubted = |what: &str, labels: Labels| {
        let told: Vec<String> = judged(&labels).map_or(vec!["nothing like a mandible".into()], |a| {
            a.checks.iter().filter(|c| !c.holds()).map(ToString::to_string).collect()
        });
        println!("{what}: {told:?}");
        assert!(!told.is_empty(), "{what}");
    };
    let jaw = |id: u8| id == MANDIBLE;
    doubted("upper jaw joined", changed(&|p, id| if id == 2 && p.y < -35.0 && p.z < -8.0 { 3 } else { id }));
    doubted("chin only", changed(&|p, id| if jaw(id) && p.y > -40.0 { 2 } else { id }));
    doubted("a ramus lost", changed(&|p, id| if jaw(id) && p.x > 30.0 && p.y > -34.0 && p.z > -48.0 { 2 } else { id }));
    doubted("condyles lost", changed(&|p, id| if jaw(id) && p.y > -14.0 && p.z > -16.0 { 2 } else { id }));
    doubted(
        "temporal bone joined",
        changed(&|p, id| if id == 2 && (p - Vec3::new(51.0, 0.0, 6.0)).norm() < 22.0 { 3 } else { id }),
    );
    doubted("spine joined", changed(&|_, id| if id == 4 { 3 } else { id }));
}
