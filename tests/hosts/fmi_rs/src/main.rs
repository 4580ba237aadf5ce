//! An archive through fmi-rs: the jaw goes down, its reaction is printed. `host ARCHIVE`; see tests/hosts/hosts.py.

use fmi_rs::fmi3::builder::FMU3Builder;
use fmi_rs::fmi3::types::fmi3Status;

const TRANSLATION: u32 = 10;
const REACTION: u32 = 120;

fn ok(what: &str, status: fmi3Status) {
    assert!(status == fmi3Status::Ok, "{what}: {status:?}");
}

fn main() {
    let path = std::env::args().nth(1).expect("an archive");
    let mut builder = FMU3Builder::new(&path).expect("a valid archive");
    (builder.eventModeUsed, builder.earlyReturnAllowed) = (false, false);
    let fmu = builder.instantiate_cs("host").expect("an instance");
    ok("enter", fmu.enterInitializationMode(None, 0.0, None));
    ok("exit", fmu.exitInitializationMode());
    let (mut d, mut f) = ([0.0; 6], [0.0; 6]);
    for k in 0..4 {
        d[5] = -f64::from(k + 1) / 1024.0;
        ok("set", fmu.setFloat64(&[TRANSLATION], &d));
        let (mut event, mut end, mut early, mut t) = (false, false, false, 0.0);
        let begin = f64::from(k) / 64.0;
        ok("step", fmu.doStep(begin, 1.0 / 64.0, true, &mut event, &mut end, &mut early, &mut t));
        ok("get", fmu.getFloat64(&[REACTION], &mut f));
    }
    ok("terminate", fmu.terminate());
    println!("{:?}", &f[3..]);
}
