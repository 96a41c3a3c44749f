//! Elements of a Mitsuba scene, and the file they become.

use std::fmt::Display;

use glam::{Affine3A, Vec3};
use quick_xml::{
    Writer,
    events::{BytesEnd, BytesStart, BytesText, Event},
};

/// An element: its tag, its attributes in order, and what is inside.
#[derive(Clone, Debug, PartialEq)]
pub struct Node {
    tag: &'static str,
    attributes: Vec<(&'static str, String)>,
    children: Vec<Node>,
}

impl Node {
    pub fn new(tag: &'static str) -> Self {
        Self { tag, attributes: Vec::new(), children: Vec::new() }
    }

    /// `<tag type="kind">`
    pub fn plugin(tag: &'static str, kind: &str) -> Self {
        Self::new(tag).attribute("type", kind)
    }

    /// `<tag name="name" value="value"/>`
    pub fn value(tag: &'static str, name: &str, value: impl Display) -> Self {
        Self::new(tag).attribute("name", name).attribute("value", value)
    }

    pub fn rgb(name: &str, color: Vec3) -> Self {
        Self::value("rgb", name, spaced(&color.to_array()))
    }

    /// A texture of any three numbers; `rgb` takes reflectances up to 1 only.
    pub fn unbounded(name: &str, color: Vec3) -> Self {
        Self::plugin("texture", "rawconstant").named(name).child(Self::xyz("vector", "value", color))
    }

    /// `<tag name="name" x="…" y="…" z="…"/>`
    pub fn xyz(tag: &'static str, name: &str, v: Vec3) -> Self {
        Self::new(tag).named(name).attribute("x", v.x).attribute("y", v.y).attribute("z", v.z)
    }

    pub fn to_world(transform: Affine3A) -> Self {
        let m = transform.matrix3;
        let row = |axis: [f32; 3], t: f32| [axis[0], axis[1], axis[2], t];
        let t = transform.translation;
        let rows = [
            row([m.x_axis.x, m.y_axis.x, m.z_axis.x], t.x),
            row([m.x_axis.y, m.y_axis.y, m.z_axis.y], t.y),
            row([m.x_axis.z, m.y_axis.z, m.z_axis.z], t.z),
            [0.0, 0.0, 0.0, 1.0],
        ];
        Self::new("transform").named("to_world").child(Self::matrix(rows.as_flattened()))
    }

    /// Row by row; 16 numbers, or 9 for a transform of the plane.
    pub fn matrix(numbers: &[f32]) -> Self {
        Self::new("matrix").attribute("value", spaced(numbers))
    }

    pub fn reference(id: &str) -> Self {
        Self::new("ref").attribute("id", id)
    }

    pub fn named(self, name: &str) -> Self {
        self.attribute("name", name)
    }

    pub fn attribute(mut self, name: &'static str, value: impl Display) -> Self {
        self.attributes.push((name, value.to_string()));
        self
    }

    pub fn child(mut self, child: Node) -> Self {
        self.children.push(child);
        self
    }

    pub fn children(mut self, children: impl IntoIterator<Item = Node>) -> Self {
        self.children.extend(children);
        self
    }

    pub fn string(self, name: &str, value: &str) -> Self {
        self.child(Self::value("string", name, value))
    }

    pub fn float(self, name: &str, value: f32) -> Self {
        self.child(Self::value("float", name, value))
    }

    pub fn integer(self, name: &str, value: impl Display) -> Self {
        self.child(Self::value("integer", name, value))
    }

    pub fn boolean(self, name: &str, value: bool) -> Self {
        self.child(Self::value("boolean", name, value))
    }

    fn write(&self, writer: &mut Writer<Vec<u8>>) -> std::io::Result<()> {
        let mut start = BytesStart::new(self.tag);
        for (name, value) in &self.attributes {
            start.push_attribute((*name, value.as_str()));
        }
        if self.children.is_empty() {
            return writer.write_event(Event::Empty(start));
        }
        writer.write_event(Event::Start(start))?;
        for child in &self.children {
            child.write(writer)?;
        }
        writer.write_event(Event::End(BytesEnd::new(self.tag)))
    }
}

/// The bytes of `scene.xml`. `comment` must not hold two dashes in a row.
pub fn document(comment: &str, root: &Node) -> std::io::Result<Vec<u8>> {
    let mut writer = Writer::new_with_indent(Vec::new(), b' ', 4);
    writer.write_event(Event::Comment(BytesText::from_escaped(comment)))?;
    root.write(&mut writer)?;
    let mut bytes = writer.into_inner();
    bytes.push(b'\n');
    Ok(bytes)
}

/// The shortest digits that read back as the same numbers.
fn spaced(numbers: &[f32]) -> String {
    // (no −0)
    let numbers: Vec<String> = numbers.iter().map(|n| (n + 0.0).to_string()).collect();
    numbers.join(" ")
}

#[cfg(test)]
mod tests {
    use glam::{Mat3A, Vec3A};

    use super::*;

    fn text(node: &Node) -> String {
        String::from_utf8(document("c", node).expect("written")).expect("UTF-8")
    }

    #[test]
    fn hostile_text_is_escaped() {
        let node = Node::new("scene").string("filename", "\"<&>'\n");
        let text = text(&node);
        assert!(!text.contains("\"<&"), "{text}");
        let mut reader = quick_xml::Reader::from_str(&text);
        let mut read = String::new();
        loop {
            match reader.read_event().expect("well-formed") {
                Event::Empty(e) => {
                    for a in e.attributes() {
                        let a = a.expect("attribute");
                        if a.key.as_ref() == "value" {
                            read = quick_xml::escape::unescape(&a.value).expect("escapes").into_owned();
                        }
                    }
                }
                Event::Eof => break,
                _ => {}
            }
        }
        assert_eq!(read.trim_end(), "\"<&>'");
    }

    #[test]
    fn matrices_go_row_by_row() {
        let turn = Mat3A::from_cols(Vec3A::Y, -Vec3A::X, Vec3A::Z);
        let node = Node::to_world(Affine3A { matrix3: turn, translation: Vec3A::new(0.1, 2.0, 1e18) });
        let text = text(&node);
        assert!(text.contains("value=\"0 -1 0 0.1 1 0 0 2 0 0 1 1000000000000000000 0 0 0 1\""), "{text}");
    }
}
