//! The rules of the DASH schema (ISO/IEC 23009-1, fifth edition) for the elements that occur here.

use roxmltree::Node;

/// Elements of the DASH schema that occur here, in the order in which their parent may have them, and its attributes.
const SCHEMA: &[(&str, &[&str], &[&str])] = &[
    (
        "MPD",
        &["ServiceDescription", "Period"],
        &[
            "profiles",
            "type",
            "availabilityStartTime",
            "publishTime",
            "mediaPresentationDuration",
            "minimumUpdatePeriod",
            "minBufferTime",
        ],
    ),
    ("ServiceDescription", &["Latency"], &["id"]),
    ("Latency", &[], &["target"]),
    ("Period", &["AdaptationSet"], &["id", "start"]),
    (
        "AdaptationSet",
        &[
            "EssentialProperty",
            "ProducerReferenceTime",
            "Resync",
            "ContentComponent",
            "SegmentTemplate",
            "Representation",
        ],
        &["id", "contentType", "mimeType", "codecs", "subsegmentAlignment"],
    ),
    ("EssentialProperty", &[], &["schemeIdUri", "value"]),
    ("ContentComponent", &[], &["id", "contentType"]),
    (
        "Representation",
        &["BaseURL", "SubRepresentation", "SegmentBase"],
        &["id", "bandwidth", "dependencyId", "frameRate", "startWithSAP"],
    ),
    ("BaseURL", &[], &[]),
    ("SubRepresentation", &[], &["level", "dependencyLevel", "bandwidth", "contentComponent"]),
    ("SegmentBase", &["Initialization"], &["indexRange", "indexRangeExact"]),
    ("Initialization", &[], &["range"]),
    ("ProducerReferenceTime", &[], &["id", "type", "wallClockTime", "presentationTime"]),
    ("Resync", &[], &["type"]),
    (
        "SegmentTemplate",
        &["SegmentTimeline"],
        &[
            "timescale",
            "initialization",
            "media",
            "startNumber",
            "availabilityTimeOffset",
            "availabilityTimeComplete",
        ],
    ),
    ("SegmentTimeline", &["S"], &[]),
    ("S", &[], &["t", "d", "r"]),
];

/// An element and those in it obey the schema.
pub(crate) fn check(node: Node<'_, '_>) {
    let name = node.tag_name().name();
    assert_eq!(node.tag_name().namespace(), Some("urn:mpeg:dash:schema:mpd:2011"));
    let (_, children, attributes) = SCHEMA.iter().find(|(known, ..)| *known == name).unwrap();
    for attribute in node.attributes() {
        assert!(attributes.contains(&attribute.name()), "{name}@{}", attribute.name());
    }
    let places: Vec<usize> = node
        .children()
        .filter(Node::is_element)
        .map(|child| children.iter().position(|known| *known == child.tag_name().name()).unwrap())
        .collect();
    assert!(places.is_sorted(), "the children of {name} are not in the order of the schema");
    node.children().filter(Node::is_element).for_each(check);
}
