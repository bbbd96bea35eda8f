#pragma once

namespace meshsmooth::server {

/// A program that calls this has gRPC serve connections by 16 threads, also where the machine has
/// fewer processors. From 1.54 on gRPC has as many threads as processors, from 4 to 16, without
/// a setting. A connection that sends faster than its frames are parsed holds one of them, and only
/// one a second is added: four such connections to a machine of two processors made all others wait
/// for 2 s.
void reserve_event_threads();

}  // namespace meshsmooth::server
