"""Parts of the model of snapshots: gate of data, noise, waves."""
