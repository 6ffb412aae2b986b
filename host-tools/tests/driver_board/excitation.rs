//! The choice of an excitation against plain sines.

use crate::excitation_compared::compared;

#[test]
fn chosen_motions_tell_more_than_plain_sines_of_the_same_length() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("rig.toml"), virtual_bench::nominal_rig_toml("bench")).unwrap();
    let all = compared(folder.path(), 9.0, 0.3, &["sine"]);
    for (words, worth) in &all {
        println!("{worth:7.2}  {words}");
    }
    let [(_, chosen), (_, slow), (_, fast)] = all[..] else { panic!("{all:?}") };
    assert!(chosen > slow && chosen > fast, "{all:?}");
}
