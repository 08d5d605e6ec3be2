"""What error the meshes keep that they promise, over many tows."""
