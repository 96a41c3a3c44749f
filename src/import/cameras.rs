//! Cameras that models bring, by name.

use crate::{
    diagnostic::{Diagnostic, Place, nearest, quote},
    world::Camera,
};

/// The camera that `name` calls, by its own name, that of its node or its number from 0; without a name, the first. The error is at
/// `place` of `file`, and says which there are.
pub(super) fn find<'c>(
    cameras: &'c [Camera],
    name: Option<&str>,
    file: &std::path::Path,
    place: &Place,
) -> Result<&'c Camera, Diagnostic> {
    let Some(name) = name else {
        return cameras.first().ok_or_else(|| {
            Diagnostic::error(file, place.clone(), "no model has a camera")
                .help("say where the camera stands: `position` and `target`")
        });
    };
    let by_name = cameras.iter().find(|camera| camera.name == name);
    let by_node = || cameras.iter().find(|camera| camera.node == name);
    let by_number = || cameras.get(name.parse::<usize>().ok()?);
    if let Some(found) = by_name.or_else(by_node).or_else(by_number) {
        return Ok(found);
    }
    let names = || cameras.iter().flat_map(|camera| [camera.name.as_str(), camera.node.as_str()]);
    let error =
        Diagnostic::error(file, place.clone(), format!("no model has a camera called {}", quote(name)));
    Err(match nearest(name, names().filter(|name| !name.is_empty())) {
        Some(near) => error.help(format!("did you mean `{near}`?")),
        None if cameras.is_empty() => error.help("there are no cameras in the models"),
        None => {
            let all: Vec<_> = cameras.iter().take(20).map(|camera| quote(&camera.name)).collect();
            error.help(format!("there are {}", all.join(", ")))
        }
    })
}
