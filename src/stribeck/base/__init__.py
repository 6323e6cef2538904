"""What every room uses: types, findings, files and processes."""
