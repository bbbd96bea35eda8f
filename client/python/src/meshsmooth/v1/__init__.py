"""The messages of the wire, made by protoc from `proto/meshsmooth/v1`; do not edit."""
