use super::*;

fn entry(name: &str, seed: u32) -> Entry {
    let pixel = |i: u32| [0, 1, 2].map(|c| crate::sampling::stats::uniform(i, seed * 3 + c));
    Entry::new(name, Vec::new(), Picture { width: 10, height: 7, pixels: (0..70).map(pixel).collect() })
}

fn group(pairs: Pairs) -> Group {
    let pictures = vec![entry("a", 0), entry("b", 1), entry("c", 2)];
    Group { name: "g".into(), description: String::new(), notes: Vec::new(), pictures, pairs }
}

#[test]
fn pairs_of_a_group() {
    let of = |pairs| -> Vec<[usize; 2]> {
        measure(&group(pairs)).expect("one size").iter().map(|p| [p.reference, p.image]).collect()
    };
    assert_eq!(of(Pairs::WithFirst), [[0, 1], [0, 2]]);
    assert_eq!(of(Pairs::All), [[0, 1], [0, 2], [1, 0], [1, 2], [2, 0], [2, 1]]);
    let mut unequal = group(Pairs::WithFirst);
    unequal.pictures[2].picture.height = 6;
    assert!(measure(&unequal).is_err());
}

/// What the page says about LDR-FLIP of a pair and of the same turned is one map.
#[test]
fn maps_that_are_equal_are_stored_once() {
    let report = Report { title: "t".into(), notes: Vec::new(), groups: vec![group(Pairs::All)] };
    let page = html(&report).expect("one size");
    assert_eq!(page.matches("id=\"blob").count(), 3 + 6 + 3);
}

/// Marks of the template in a name are not replaced; and the page is whole.
#[test]
fn names_do_not_meddle() {
    let mut report =
        Report { title: "/*scripts*/<!--blobs-->".into(), notes: Vec::new(), groups: Vec::new() };
    report.groups.push(Group { name: "/*report*/</script>".into(), ..group(Pairs::WithFirst) });
    let page = html(&report).expect("one size");
    assert!(page.contains("<title>/*scripts*/&lt;!--blobs--&gt;</title>"));
    assert_eq!(page.matches("function paintMap").count(), 1);
    assert!(page.contains("\"name\":\"/*report*/\\u003c/script>\""));
    assert!(page.trim_end().ends_with("</html>"));
    assert!(["https:", "url(", "@import", " src="].iter().all(|fetch| !page.contains(fetch)));
}

#[test]
fn short_names_tell_files_apart() {
    let names = |files: &[&str]| short_names(&files.iter().map(Path::new).collect::<Vec<_>>());
    assert_eq!(names(&["x/a.exr", "y/b.exr"]), ["a.exr", "b.exr"]);
    assert_eq!(names(&["old/s/a.exr", "new/s/a.exr"]), ["old/s/a.exr", "new/s/a.exr"]);
    assert_eq!(names(&["a.exr", "a.exr"]), ["a.exr", "a.exr"]);
}
