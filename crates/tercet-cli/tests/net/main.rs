//! The server and its client, on loopback.

mod bucket;
mod certificates;
mod conditions;
mod encoding;
mod faults;
mod fetch;
mod folder;
mod link;
mod load;
mod namespaces;
mod plain;
mod session;
mod site;
mod webtransport;
