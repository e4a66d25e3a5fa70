//! The committed modelDescription.xml is the one that the variable table gives.

use std::path::Path;

/// Importers unpack the committed file; the library checks the GUID of the generated one. They must be the
/// same.
#[test]
fn the_committed_description_is_not_stale() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("modelDescription/modelDescription.xml");
    let committed = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(
        committed == swarf::fmi::description::xml(),
        "{} is stale; run: cargo xtask describe",
        path.display()
    );
}
