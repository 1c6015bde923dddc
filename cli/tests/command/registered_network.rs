//! The networks that the specification registers: what they are called is what they are.

use sha2::{Digest, Sha256};
use splatstream_format::payload::{Network, REGISTRY, Weights};

// covers: SS-WT-001
#[test]
fn registered_networks_have_their_digests_and_stand_in_the_text() {
    let text = include_str!("../../../spec/06-semantics.md");
    for (name, bytes) in REGISTRY {
        assert_eq!(Sha256::digest(bytes)[..], name);
        let name: String = name.iter().map(|byte| format!("{byte:02x}")).collect();
        assert!(text.contains(&format!("| `{name}` |")), "{name}");
    }
}

#[test]
fn a_registered_network_is_used_as_if_it_were_carried() {
    for (name, bytes) in REGISTRY {
        let network = Network::parse(bytes, 0).unwrap();
        assert_eq!(network.to_bytes().unwrap(), bytes);
        assert_eq!(Weights::Registered(name).network(0), Ok(network));
    }
}
