//! No panic that the control tick can reach in the image, but those that are known never to
//! be taken.

use hil_sim::firmware::{self, Profile};
use rig_board::panics::walk;

#[test]
fn the_control_tick_reaches_no_panic_of_its_own() {
    let path = firmware::build(Profile::Release).expect("the firmware builds");
    let elf = std::fs::read(path).expect("readable");
    let found = walk(&elf).expect("an image with debug information");
    // What was walked is what it is said to be: the tick and what it calls.
    assert_eq!(found.roots.len(), 5);
    assert!(found.reached > 20 && found.reached < found.functions, "{}", found.reached);
    let reached = |name: &str| {
        found.panics.iter().chain(&found.indirect).any(|site| {
            site.path
                .iter()
                .chain(site.frames.iter().map(|f| &f.function))
                .any(|f| f.contains(name))
        })
    };
    assert!(reached("tasks::motors::motors") && reached("tasks::sensors::angle"));
    let unexplained: Vec<String> = found
        .unexplained()
        .map(|site| {
            format!("{:#x} {} -> {} {:#?}", site.address, site.place(), site.calls, site.frames)
        })
        .collect();
    assert!(unexplained.is_empty(), "{unexplained:#?}");
    // In the controller itself there is not even one that is known to be harmless.
    let own =
        ["src/tick", "src/control/", "src/estimate/", "src/supervise/", "src/sense/", "src/model/"];
    for site in &found.panics {
        let within = site.frames.iter().find(|frame| own.iter().any(|o| frame.file.starts_with(o)));
        let made = site.frames.iter().find(|frame| !frame.function.starts_with("core::"));
        assert!(within.is_none() || within != made, "{site:#?}");
    }
}
