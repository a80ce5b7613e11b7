"""What every package needs: errors, files, tables, configuration, parallel work, progress."""
