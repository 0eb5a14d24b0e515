from geomech.cli import main

main()
