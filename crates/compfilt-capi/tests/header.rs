//! The committed header is the one that the sources give. `UPDATE_HEADER=1 cargo test -p compfilt-capi` makes it anew.

use std::path::Path;

#[test]
fn the_header_is_up_to_date() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let config = cbindgen::Config::from_root_or_default(folder);
    let bindings = cbindgen::Builder::new().with_crate(folder).with_config(config).generate();
    let mut made = Vec::new();
    bindings.expect("cbindgen understands the crate").write(&mut made);
    let made = String::from_utf8(made).expect("a header is text");
    let path = folder.join("../../python/compfilt/include/compfilt.h");
    if std::env::var_os("UPDATE_HEADER").is_some() {
        std::fs::write(&path, &made).expect("the header can be written");
    }
    let committed = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(
        committed == made,
        "python/compfilt/include/compfilt.h is old: UPDATE_HEADER=1 cargo test -p compfilt-capi makes it anew"
    );
}
