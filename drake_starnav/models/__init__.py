"""Model files: URDF, xacro and SDF as they are found, their folders and meshes, and what Drake says of them."""
